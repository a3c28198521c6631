// LD_PRELOAD shim: stops the process (SIGSTOP, all threads) that is the first to send a certain
// datagram, right before or right after it is sent, so that a test can kill at a known point.
// On udpm LCM sends a small message with one sendmsg. On tcpq, in the clear, a send may hold
// several messages, and all of them count as sent with it.
//
//   SKEIN_STOP_AT    before|after
//   SKEIN_STOP_TEXT  texts that the datagram holds, separated by blanks
//   SKEIN_STOP_MARK  file that is made then, with the process id; while it exists nothing is
//   stopped
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

enum { kMaxDatagram = 65536 };

static size_t flatten(const struct msghdr* message, char* bytes) {
  size_t size = 0;
  for (size_t i = 0; i < message->msg_iovlen; ++i) {
    const struct iovec part = message->msg_iov[i];
    if (size + part.iov_len > kMaxDatagram) break;
    memcpy(bytes + size, part.iov_base, part.iov_len);
    size += part.iov_len;
  }
  return size;
}

static int holds_all(const char* bytes, size_t size, const char* texts) {
  while (*texts) {
    const size_t length = strcspn(texts, " ");
    if (!memmem(bytes, size, texts, length)) return 0;
    texts += length + strspn(texts + length, " ");
  }
  return 1;
}

static void stop_if_first(void) {
  const char* mark = getenv("SKEIN_STOP_MARK");
  const int file = mark ? open(mark, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644) : -1;
  if (file < 0) return;
  dprintf(file, "%d\n", getpid());
  close(file);
  kill(getpid(), SIGSTOP);
}

ssize_t sendmsg(int fd, const struct msghdr* message, int flags) {
  static ssize_t (*next)(int, const struct msghdr*, int);
  if (!next) next = dlsym(RTLD_NEXT, "sendmsg");
  const char* texts = getenv("SKEIN_STOP_TEXT");
  const char* at = getenv("SKEIN_STOP_AT");
  static __thread char bytes[kMaxDatagram];
  if (!texts || !at || !holds_all(bytes, flatten(message, bytes), texts)) {
    return next(fd, message, flags);
  }
  if (strcmp(at, "before") == 0) stop_if_first();
  const ssize_t sent = next(fd, message, flags);
  const int saved_errno = errno;
  if (strcmp(at, "after") == 0) stop_if_first();
  errno = saved_errno;
  return sent;
}

ssize_t send(int fd, const void* data, size_t size, int flags) {
  static ssize_t (*next)(int, const void*, size_t, int);
  if (!next) next = dlsym(RTLD_NEXT, "send");
  const char* texts = getenv("SKEIN_STOP_TEXT");
  const char* at = getenv("SKEIN_STOP_AT");
  if (!texts || !at || !holds_all(data, size, texts)) return next(fd, data, size, flags);
  if (strcmp(at, "before") == 0) stop_if_first();
  const ssize_t sent = next(fd, data, size, flags);
  const int saved_errno = errno;
  if (strcmp(at, "after") == 0) stop_if_first();
  errno = saved_errno;
  return sent;
}
