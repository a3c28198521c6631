// LD_PRELOAD shim: one call of a process fails, as on a full or broken disk or without memory.
// Counts from when the process asks for it, by skein_arm_faults() (found by dlsym): the start of a
// program is not the store's.
//
//   SKEIN_FAIL_CALL    write (also pwrite, ftruncate), sync (fsync, fdatasync), rename (also link,
//                      mkdir; by descriptor, too), open, or malloc (also calloc, realloc)
//   SKEIN_FAIL_AT      the number of the call that fails, from 1; open fails from then on (as
//                      without descriptors), the others once
//   SKEIN_FAIL_ERRNO   the error, a number; malloc returns NULL
//   SKEIN_FAIL_UNDER   only files under this folder
//
// skein_count_faults() returns how many such calls there were: above SKEIN_FAIL_AT - 1, it failed.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shim.h"

static atomic_int armed;
static atomic_long counted;
static char call[16], under[4096];
static long fail_at;
static int fail_errno;

void skein_arm_faults(void) {
  const char* text = getenv("SKEIN_FAIL_CALL");
  snprintf(call, sizeof(call), "%s", text ? text : "");
  text = getenv("SKEIN_FAIL_UNDER");
  snprintf(under, sizeof(under), "%s", text ? text : "");
  text = getenv("SKEIN_FAIL_AT");
  fail_at = text ? atol(text) : 0;
  text = getenv("SKEIN_FAIL_ERRNO");
  fail_errno = text ? atoi(text) : EIO;
  atomic_store(&armed, 1);
}

long skein_count_faults(void) {
  atomic_store(&armed, 0);
  return atomic_load(&counted);
}

static int is_under(const char* path) {
  return under[0] != 0 && path != NULL && strncmp(path, under, strlen(under)) == 0;
}

static int is_fd_under(int fd) {
  char link[64], path[4096];
  snprintf(link, sizeof(link), "/proc/self/fd/%d", fd);
  const ssize_t size = readlink(link, path, sizeof(path) - 1);
  if (size <= 0) return 0;
  path[size] = 0;
  return is_under(path);
}

static int fails_now(const char* kind) {
  if (strcmp(call, kind) != 0) return 0;
  const long number = atomic_fetch_add(&counted, 1) + 1;
  const int fails = strcmp(kind, "open") == 0 ? number >= fail_at : number == fail_at;
  if (fails && fail_at > 0) errno = fail_errno;
  return fails && fail_at > 0;
}

static int fd_fails(const char* kind, int fd) {
  const int before = errno;
  if (!atomic_load(&armed) || strcmp(call, kind) != 0 || !is_fd_under(fd)) {
    errno = before;
    return 0;
  }
  errno = before;
  return fails_now(kind);
}

static int path_fails(const char* kind, const char* path) {
  return atomic_load(&armed) && is_under(path) && fails_now(kind);
}

// Of a failing write half arrives: what a full disk does.
ssize_t write(int fd, const void* data, size_t size) {
  NEXT(write_fn, "write");
  if (!fd_fails("write", fd)) return next(fd, data, size);
  next(fd, data, size / 2);
  errno = fail_errno;
  return -1;
}
static ssize_t pwrite_half(const char* name, int fd, const void* data, size_t size, off_t at) {
  pwrite_fn next = (pwrite_fn)dlsym(RTLD_NEXT, name);
  if (!fd_fails("write", fd)) return next(fd, data, size, at);
  next(fd, data, size / 2, at);
  errno = fail_errno;
  return -1;
}
ssize_t pwrite(int fd, const void* data, size_t size, off_t at) {
  return pwrite_half("pwrite", fd, data, size, at);
}
ssize_t pwrite64(int fd, const void* data, size_t size, off_t at) {
  return pwrite_half("pwrite64", fd, data, size, at);
}
int ftruncate(int fd, off_t size) {
  NEXT(truncate_fn, "ftruncate");
  return fd_fails("write", fd) ? -1 : next(fd, size);
}
int ftruncate64(int fd, off_t size) {
  NEXT(truncate_fn, "ftruncate64");
  return fd_fails("write", fd) ? -1 : next(fd, size);
}
int fsync(int fd) {
  NEXT(fd_fn, "fsync");
  return fd_fails("sync", fd) ? -1 : next(fd);
}
int fdatasync(int fd) {
  NEXT(fd_fn, "fdatasync");
  return fd_fails("sync", fd) ? -1 : next(fd);
}
int syncfs(int fd) {
  NEXT(fd_fn, "syncfs");
  return fd_fails("sync", fd) ? -1 : next(fd);
}
int rename(const char* from, const char* to) {
  NEXT(paths_fn, "rename");
  return path_fails("rename", to) ? -1 : next(from, to);
}
int link(const char* from, const char* to) {
  NEXT(paths_fn, "link");
  return path_fails("rename", to) ? -1 : next(from, to);
}
int mkdir(const char* path, mode_t mode) {
  NEXT(mkdir_fn, "mkdir");
  return path_fails("rename", path) ? -1 : next(path, mode);
}
static int fails_in(const char* kind, int folder, const char* path) {
  const int before = errno;
  char whole[MOST_PATH_BYTES];
  if (!atomic_load(&armed) || strcmp(call, kind) != 0) return 0;
  const char* meant = path_in(folder, path, whole);
  errno = before;
  return path_fails(kind, meant);
}
int mkdirat(int folder, const char* path, mode_t mode) {
  NEXT(mkdirat_fn, "mkdirat");
  return fails_in("rename", folder, path) ? -1 : next(folder, path, mode);
}
int renameat(int from_folder, const char* from, int to_folder, const char* to) {
  NEXT(renameat_fn, "renameat");
  return fails_in("rename", to_folder, to) ? -1 : next(from_folder, from, to_folder, to);
}

#define OPEN(name)                                                  \
  int name(const char* path, int flags, ...) {                      \
    NEXT(open_fn, #name);                                           \
    va_list arguments;                                              \
    va_start(arguments, flags);                                     \
    const mode_t mode = mode_of(flags, arguments);                  \
    va_end(arguments);                                              \
    return path_fails("open", path) ? -1 : next(path, flags, mode); \
  }
OPEN(open)
OPEN(open64)
#define OPENAT(name)                                                              \
  int name(int folder, const char* path, int flags, ...) {                        \
    NEXT(openat_fn, #name);                                                       \
    va_list arguments;                                                            \
    va_start(arguments, flags);                                                   \
    const mode_t mode = mode_of(flags, arguments);                                \
    va_end(arguments);                                                            \
    return fails_in("open", folder, path) ? -1 : next(folder, path, flags, mode); \
  }
OPENAT(openat)
OPENAT(openat64)

// glibc's own names: dlsym itself allocates.
extern void* __libc_malloc(size_t);
extern void* __libc_calloc(size_t, size_t);
extern void* __libc_realloc(void*, size_t);

static int memory_fails(void) { return atomic_load(&armed) && fails_now("malloc"); }
void* malloc(size_t size) { return memory_fails() ? NULL : __libc_malloc(size); }
void* calloc(size_t count, size_t size) {
  return memory_fails() ? NULL : __libc_calloc(count, size);
}
void* realloc(void* block, size_t size) {
  return memory_fails() ? NULL : __libc_realloc(block, size);
}
