// LD_PRELOAD shim: drops a share of the UDP datagrams that a process sends (sendto, sendmsg), so
// that loss can be tested without netem. TCP and local sockets are left alone.
//
//   SKEIN_DROP_PERCENT  share to drop, 0..100
//   SKEIN_DROP_SEED     the same seed drops the same datagrams of a process
//   SKEIN_DROP_LOG      file to which each process appends "PID NAME SENT DROPPED" when it exits
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

static atomic_uint_fast64_t sent, dropped;

static uint64_t environment_number(const char* name) {
  const char* text = getenv(name);
  return text ? strtoull(text, NULL, 10) : 0;
}

// SplitMix64 of the datagram's number: no state but the counter, so threads need no lock.
static int is_unlucky(uint64_t number) {
  uint64_t z = environment_number("SKEIN_DROP_SEED") + (number + 1) * 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return (z ^ (z >> 31)) % 10000 < 100 * environment_number("SKEIN_DROP_PERCENT");
}

static int is_internet_datagram_socket(int fd) {
  int type = 0, domain = 0;
  socklen_t size = sizeof(int);
  if (getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_DGRAM) return 0;
  size = sizeof(int);
  if (getsockopt(fd, SOL_SOCKET, SO_DOMAIN, &domain, &size) != 0) return 0;
  return domain == AF_INET || domain == AF_INET6;
}

static int drops_now(int fd) {
  const int saved_errno = errno;
  int drop = 0;
  if (is_internet_datagram_socket(fd)) {
    drop = is_unlucky(atomic_fetch_add(&sent, 1));
    if (drop) atomic_fetch_add(&dropped, 1);
  }
  errno = saved_errno;
  return drop;
}

ssize_t sendto(int fd, const void* data, size_t size, int flags, const struct sockaddr* to,
               socklen_t to_size) {
  static ssize_t (*next)(int, const void*, size_t, int, const struct sockaddr*, socklen_t);
  if (!next) next = dlsym(RTLD_NEXT, "sendto");
  return drops_now(fd) ? (ssize_t)size : next(fd, data, size, flags, to, to_size);
}

ssize_t sendmsg(int fd, const struct msghdr* message, int flags) {
  static ssize_t (*next)(int, const struct msghdr*, int);
  if (!next) next = dlsym(RTLD_NEXT, "sendmsg");
  if (!drops_now(fd)) return next(fd, message, flags);
  ssize_t size = 0;
  for (size_t i = 0; i < message->msg_iovlen; ++i) size += message->msg_iov[i].iov_len;
  return size;
}

__attribute__((destructor)) static void report(void) {
  const char* path = getenv("SKEIN_DROP_LOG");
  const unsigned long total = atomic_load(&sent);
  FILE* log = path && total ? fopen(path, "a") : NULL;
  if (!log) return;
  fprintf(log, "%d %s %lu %lu\n", getpid(), program_invocation_short_name, total,
          (unsigned long)atomic_load(&dropped));
  fclose(log);
}
