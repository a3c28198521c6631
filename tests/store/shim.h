// What LD_PRELOAD shims of file calls share.
#pragma once

#include <dlfcn.h>
#include <fcntl.h>
#include <stdarg.h>
#include <sys/types.h>

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
typedef int (*open_fn)(const char*, int, ...);
typedef int (*openat_fn)(int, const char*, int, ...);

// Of open and openat: the argument that is there where a file may be created.
static inline mode_t mode_of(int flags, va_list arguments) {
  return (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(arguments, mode_t) : 0;
}
