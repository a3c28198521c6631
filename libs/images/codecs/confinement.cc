#include "codecs/confinement.h"

#include <seccomp.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <string>

namespace skein {
namespace {

using Filter = std::unique_ptr<void, decltype(&seccomp_release)>;

constexpr int kAllowed[] = {SCMP_SYS(brk),
                            SCMP_SYS(munmap),
                            SCMP_SYS(mremap),
                            SCMP_SYS(madvise),
                            SCMP_SYS(futex),
                            SCMP_SYS(clock_gettime),
                            SCMP_SYS(gettimeofday),
                            SCMP_SYS(time),
                            SCMP_SYS(getrandom),
                            SCMP_SYS(getpid),
                            SCMP_SYS(gettid),
                            SCMP_SYS(sched_yield),
                            SCMP_SYS(sysinfo),
                            SCMP_SYS(rt_sigprocmask),
                            SCMP_SYS(rt_sigreturn),
                            SCMP_SYS(exit),
                            SCMP_SYS(restart_syscall),
                            SCMP_SYS(exit_group),
                            SCMP_SYS(sigaltstack),
                            SCMP_SYS(sched_getaffinity)};

constexpr int kLooksAtFiles[] = {
    SCMP_SYS(open),       SCMP_SYS(openat),     SCMP_SYS(openat2),   SCMP_SYS(creat),
    SCMP_SYS(stat),       SCMP_SYS(lstat),      SCMP_SYS(fstat),     SCMP_SYS(newfstatat),
    SCMP_SYS(statx),      SCMP_SYS(access),     SCMP_SYS(faccessat), SCMP_SYS(faccessat2),
    SCMP_SYS(readlink),   SCMP_SYS(readlinkat), SCMP_SYS(getcwd),    SCMP_SYS(ioctl),
    SCMP_SYS(getdents64), SCMP_SYS(lseek),      SCMP_SYS(fcntl),     SCMP_SYS(close)};

int AllowWithArguments(void* filter, int socket) {
  const auto no_code = SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0);
  const auto own = SCMP_A0(SCMP_CMP_EQ, static_cast<scmp_datum_t>(getpid()));
  int error = 0;
  for (const int call : {SCMP_SYS(mmap), SCMP_SYS(mprotect)}) {
    error |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, call, 1, no_code);
  }
  const auto from_socket = SCMP_A0(SCMP_CMP_EQ, static_cast<scmp_datum_t>(socket));
  error |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(read), 1, from_socket);
  for (const int fd : {STDOUT_FILENO, STDERR_FILENO, socket}) {
    const auto to = SCMP_A0(SCMP_CMP_EQ, static_cast<scmp_datum_t>(fd));
    error |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(write), 1, to);
    error |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(writev), 1, to);
  }
  // What abort() does.
  error |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(tgkill), 1, own);
  return error;
}

int Load(void* filter, int socket) {
  int error = 0;
  for (const int call : kAllowed) error |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, call, 0);
  for (const int call : kLooksAtFiles) {
    error |= seccomp_rule_add(filter, SCMP_ACT_ERRNO(EACCES), call, 0);
  }
  error |= AllowWithArguments(filter, socket);
  return error != 0 ? error : seccomp_load(filter);
}

Status LimitFiles() {
  const rlimit none{0, 0};
  if (setrlimit(RLIMIT_FSIZE, &none) == 0 && setrlimit(RLIMIT_CORE, &none) == 0)
    return Status::Ok();
  return Unavailable(std::string("cannot limit files: ") + std::strerror(errno));
}

}  // namespace

Status ConfineThisProcess(int socket) {
  if (Status status = LimitFiles(); !status.ok()) return status;
  const Filter filter(seccomp_init(SCMP_ACT_KILL_PROCESS), seccomp_release);
  const int error = filter == nullptr ? -ENOMEM : Load(filter.get(), socket);
  if (error == 0) return Status::Ok();
  return Unavailable(std::string("system calls cannot be limited (seccomp; Linux 4.14 or newer ") +
                     "has it, a container may forbid it): " + std::strerror(-error));
}

}  // namespace skein
