// What LD_PRELOAD shims of file calls share.
#pragma once

#include <dlfcn.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>

#define MOST_PATH_BYTES 4096

// The call that the shim stands before.
#define NEXT(type, name) \
  static type next;      \
  if (!next) next = (type)dlsym(RTLD_NEXT, name)

typedef ssize_t (*write_fn)(int, const void*, size_t);
typedef ssize_t (*pwrite_fn)(int, const void*, size_t, off_t);
typedef int (*truncate_fn)(int, off_t);
typedef int (*fd_fn)(int);
typedef int (*path_fn)(const char*);
typedef int (*paths_fn)(const char*, const char*);
typedef int (*mkdir_fn)(const char*, mode_t);
typedef int (*mkdirat_fn)(int, const char*, mode_t);
typedef int (*renameat_fn)(int, const char*, int, const char*);
typedef int (*unlinkat_fn)(int, const char*, int);
typedef int (*open_fn)(const char*, int, ...);
typedef int (*openat_fn)(int, const char*, int, ...);

// The path that a call by descriptor means, in `whole`, which has MOST_PATH_BYTES.
static inline const char* path_in(int folder, const char* path, char* whole) {
  char link[64];
  if (folder == AT_FDCWD || path[0] == '/') return path;
  snprintf(link, sizeof(link), "/proc/self/fd/%d", folder);
  const ssize_t size = readlink(link, whole, MOST_PATH_BYTES - 1);
  if (size <= 0) return path;
  snprintf(whole + size, MOST_PATH_BYTES - (size_t)size, "/%s", path);
  return whole;
}

// Of open and openat: the argument that is there where a file may be created.
static inline mode_t mode_of(int flags, va_list arguments) {
  return (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(arguments, mode_t) : 0;
}
