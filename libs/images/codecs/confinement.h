#pragma once

#include "core/result.h"

namespace skein {

// Takes from this process, for good, what decoding does not need (seccomp(2), by libseccomp).
// Allowed are: memory that is not executable, time, reading the descriptor `socket`, writing to it
// and to stdout and stderr, ending. Opening or looking up a file, of any kind, fails with EACCES:
// libraries look for optional ones. Any other system call ends the process by SIGSYS: sockets,
// programs, threads, signals to others. No file grows, and no core is written.
//
// The process must have one thread. An error leaves it as it was, or partly confined.
Status ConfineThisProcess(int socket);

}  // namespace skein
