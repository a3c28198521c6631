// LD_PRELOAD shim: writes down what a process does to the files under a folder, so that the states
// that a power loss could leave can be made from it (tests/store/power_loss.h).
//
//   SKEIN_RECORD_UNDER   the folder
//   SKEIN_RECORD_TO      the log
//
// A record: kind (1 byte), number of the file descriptor (int32), offset, size of the text, size of
// the data (int64 each), text, data; little endian. Kinds:
//   o  opened: text is the path; offset 1: with O_TRUNC      w  written: data at offset
//   t  cut or grown to offset    s  synced    r  renamed: text is FROM, 0, TO
//   l  linked: the same          u  removed: text is the path     m  folder made: likewise
//   a  the whole file system synced
//   n  a note of the process itself, by skein_note(text)
// One thread at a time.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "shim.h"

enum { MOST_FDS = 1024 };
static char tracked[MOST_FDS];
static int log_fd = -1;
static const char* under;

static void append(const void* data, size_t size) {
  if (syscall(SYS_write, log_fd, data, size) != (long)size) abort();
}

static void record(char kind, int32_t fd, int64_t offset, const char* text, int64_t text_size,
                   const void* data, int64_t size) {
  const int before = errno;
  if (log_fd < 0) {
    const char* path = getenv("SKEIN_RECORD_TO");
    if (!path) return;
    log_fd =
        (int)syscall(SYS_openat, AT_FDCWD, path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    if (log_fd < 0) abort();
  }
  append(&kind, 1);
  append(&fd, sizeof(fd));
  append(&offset, sizeof(offset));
  append(&text_size, sizeof(text_size));
  append(&size, sizeof(size));
  append(text, (size_t)text_size);
  append(data, (size_t)size);
  errno = before;
}

void skein_note(const char* text) { record('n', -1, 0, text, (int64_t)strlen(text), "", 0); }

static int is_under(const char* path) {
  if (!under) under = getenv("SKEIN_RECORD_UNDER");
  return under && strncmp(path, under, strlen(under)) == 0;
}
static int is_tracked(int fd) { return fd >= 0 && fd < MOST_FDS && tracked[fd]; }

static int opened(int fd, const char* path, int flags) {
  if (fd < 0 || fd >= MOST_FDS) return fd;
  tracked[fd] = (char)is_under(path);
  if (tracked[fd]) record('o', fd, (flags & O_TRUNC) != 0, path, (int64_t)strlen(path), "", 0);
  return fd;
}

ssize_t write(int fd, const void* data, size_t size) {
  NEXT(write_fn, "write");
  const ssize_t written = next(fd, data, size);
  if (written > 0 && is_tracked(fd)) {
    record('w', fd, lseek(fd, 0, SEEK_CUR) - written, "", 0, data, written);
  }
  return written;
}
static ssize_t written_at(int fd, const void* data, ssize_t written, off_t at) {
  if (written > 0 && is_tracked(fd)) record('w', fd, at, "", 0, data, written);
  return written;
}
ssize_t pwrite(int fd, const void* data, size_t size, off_t at) {
  NEXT(pwrite_fn, "pwrite");
  return written_at(fd, data, next(fd, data, size, at), at);
}
ssize_t pwrite64(int fd, const void* data, size_t size, off_t at) {
  NEXT(pwrite_fn, "pwrite64");
  return written_at(fd, data, next(fd, data, size, at), at);
}
static int truncated(int fd, int result, off_t size) {
  if (result == 0 && is_tracked(fd)) record('t', fd, size, "", 0, "", 0);
  return result;
}
int ftruncate(int fd, off_t size) {
  NEXT(truncate_fn, "ftruncate");
  return truncated(fd, next(fd, size), size);
}
int ftruncate64(int fd, off_t size) {
  NEXT(truncate_fn, "ftruncate64");
  return truncated(fd, next(fd, size), size);
}
static int synced(int fd, int result) {
  if (result == 0 && is_tracked(fd)) record('s', fd, 0, "", 0, "", 0);
  return result;
}
int fsync(int fd) {
  NEXT(fd_fn, "fsync");
  return synced(fd, next(fd));
}
int fdatasync(int fd) {
  NEXT(fd_fn, "fdatasync");
  return synced(fd, next(fd));
}

int syncfs(int fd) {
  NEXT(fd_fn, "syncfs");
  const int result = next(fd);
  if (result == 0) record('a', fd, 0, "", 0, "", 0);
  return result;
}

static int moved(char kind, int result, const char* from, const char* to) {
  if (result != 0 || !is_under(to)) return result;
  char text[8192];
  const int size = snprintf(text, sizeof(text), "%s%c%s", from, 0, to);
  record(kind, -1, 0, text, size, "", 0);
  return result;
}
int rename(const char* from, const char* to) {
  NEXT(paths_fn, "rename");
  return moved('r', next(from, to), from, to);
}
int link(const char* from, const char* to) {
  NEXT(paths_fn, "link");
  return moved('l', next(from, to), from, to);
}
static int changed(char kind, int result, const char* path) {
  if (result == 0 && is_under(path)) record(kind, -1, 0, path, (int64_t)strlen(path), "", 0);
  return result;
}
int unlink(const char* path) {
  NEXT(path_fn, "unlink");
  return changed('u', next(path), path);
}
int remove(const char* path) {
  NEXT(path_fn, "remove");
  return changed('u', next(path), path);
}
int mkdir(const char* path, mode_t mode) {
  NEXT(mkdir_fn, "mkdir");
  return changed('m', next(path, mode), path);
}

int mkdirat(int folder, const char* path, mode_t mode) {
  NEXT(mkdirat_fn, "mkdirat");
  char whole[MOST_PATH_BYTES];
  return changed('m', next(folder, path, mode), path_in(folder, path, whole));
}
int renameat(int from_folder, const char* from, int to_folder, const char* to) {
  NEXT(renameat_fn, "renameat");
  char whole_from[MOST_PATH_BYTES], whole_to[MOST_PATH_BYTES];
  const int result = next(from_folder, from, to_folder, to);
  return moved('r', result, path_in(from_folder, from, whole_from),
               path_in(to_folder, to, whole_to));
}
int unlinkat(int folder, const char* path, int flags) {
  NEXT(unlinkat_fn, "unlinkat");
  char whole[MOST_PATH_BYTES];
  const int result = next(folder, path, flags);
  return flags == 0 ? changed('u', result, path_in(folder, path, whole)) : result;
}

#define OPEN(name)                                       \
  int name(const char* path, int flags, ...) {           \
    NEXT(open_fn, #name);                                \
    va_list arguments;                                   \
    va_start(arguments, flags);                          \
    const mode_t mode = mode_of(flags, arguments);       \
    va_end(arguments);                                   \
    return opened(next(path, flags, mode), path, flags); \
  }
OPEN(open)
OPEN(open64)
#define OPENAT(name)                                                                     \
  int name(int folder, const char* path, int flags, ...) {                               \
    NEXT(openat_fn, #name);                                                              \
    va_list arguments;                                                                   \
    va_start(arguments, flags);                                                          \
    const mode_t mode = mode_of(flags, arguments);                                       \
    va_end(arguments);                                                                   \
    char whole[MOST_PATH_BYTES];                                                         \
    return opened(next(folder, path, flags, mode), path_in(folder, path, whole), flags); \
  }
OPENAT(openat)
OPENAT(openat64)
