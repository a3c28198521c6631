#pragma once

#include <sys/types.h>

#include <functional>
#include <memory>

#include "core/bytes.h"
#include "core/result.h"

namespace skein {

// Bytes that a function computes from this process's memory as it is now, while the process goes
// on. A forked child runs the function at low priority and sends the bytes back; the kernel copies
// a page when either process writes it. Taking a snapshot copies page tables, about 2 ms a GiB. The
// child has only the calling thread, so the function must not wait for another thread. Memory
// allocation works in the child (glibc).
class Snapshot {
 public:
  // On the thread that owns what the function reads. An error when the system has no process left.
  static Result<std::shared_ptr<Snapshot>> Take(const std::function<Bytes()>& encode);

  // Waits for the bytes; on any thread, once. An error when the child failed.
  Result<Bytes> Read();

  // Ends the child if it is still at work.
  ~Snapshot();
  Snapshot(const Snapshot&) = delete;
  Snapshot& operator=(const Snapshot&) = delete;

 private:
  Snapshot(pid_t child, int read_fd) : child_(child), read_fd_(read_fd) {}

  pid_t child_;
  int read_fd_;
};

}  // namespace skein
