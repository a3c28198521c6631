#pragma once

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <thread>
#include <vector>

namespace skein {

// Threads that run at once on this host, at least 1.
inline int NumHardwareThreads() {
  return static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

// The nice value of this thread: on Linux each has its own.
inline void SetNicenessOfThread(int niceness) {
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), niceness);
}

// Calls function(0) to function(num_threads - 1) at once, the first one on the calling thread, and
// returns when all have returned. The calls must not throw.
template <typename Function>
void RunOnThreads(int num_threads, const Function& function) {
  std::vector<std::thread> threads;
  for (int i = 1; i < num_threads; ++i) threads.emplace_back([&function, i] { function(i); });
  function(0);
  for (std::thread& thread : threads) thread.join();
}

// Calls function(i) for 0 <= i < count. Neighbouring i go to different threads, so each has its
// share of what costs most.
template <typename Function>
void ForEachOnThreads(int num_threads, size_t count, const Function& function) {
  RunOnThreads(num_threads, [&](int thread) {
    for (size_t i = thread; i < count; i += num_threads) function(i);
  });
}

}  // namespace skein
