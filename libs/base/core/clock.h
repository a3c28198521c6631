// Clocks: UTC for what is recorded, monotonic for what is measured.
#pragma once

#include <time.h>

#include <chrono>
#include <cstdint>
#include <functional>

namespace skein {

// Microseconds since 1970 UTC.
inline int64_t NowUs() {
  using namespace std::chrono;
  return duration_cast<microseconds>(system_clock::now().time_since_epoch()).count();
}

// Seconds on a clock that never jumps; its zero means nothing.
inline double MonotonicS() {
  using namespace std::chrono;
  return duration<double>(steady_clock::now().time_since_epoch()).count();
}

// Seconds, as MonotonicS; a test gives its own. Code that asks what is due uses a Clock that is
// passed in.
using Clock = std::function<double()>;

// Seconds of CPU that the calling thread has used.
inline double ThreadCpuS() {
  timespec used{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
  return static_cast<double>(used.tv_sec) + used.tv_nsec * 1e-9;
}

// Measures from its construction.
class Timer {
 public:
  double ElapsedS() const { return MonotonicS() - start_s_; }
  void Restart() { start_s_ = MonotonicS(); }

 private:
  double start_s_ = MonotonicS();
};

}  // namespace skein
