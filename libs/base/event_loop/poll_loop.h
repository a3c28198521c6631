// The one thread of a process that runs its handlers: poll(2) over descriptors, timers, posted
// functions, and SIGINT/SIGTERM.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/clock.h"

namespace skein {

// All but Post, Stop and now_s belong to the loop's thread, or to the constructing thread before
// Run. Handlers must not block. An exception of a timer's handler is noted, and the handler is
// called again: after its period, or kRetryS later where it is called once. Each handler looks at
// the present state, so it makes up for the call that failed. A BrokenState (core/attempt.h), and
// any exception of another handler, leaves Run.
class PollLoop {
 public:
  using Handler = std::function<void()>;
  using TimerId = int64_t;
  static constexpr double kRetryS = 1;

  // Exceptions that this loop has noted.
  struct Thrown {
    int64_t count = 0;
    std::string last;   // source and text of the last one
    double last_s = 0;  // now_s() of the last one
  };

  // Timers go by `clock`, which any thread may call; RunUntil waits real seconds.
  explicit PollLoop(Clock clock = MonotonicS);
  ~PollLoop();
  PollLoop(const PollLoop&) = delete;
  PollLoop& operator=(const PollLoop&) = delete;

  // The time for all that this loop runs.
  double now_s() const { return clock_(); }

  // Calls `on_readable` whenever the descriptor can be read or has failed. The descriptor stays
  // the caller's, who removes it before closing it. One handler a descriptor: throws otherwise.
  void AddFd(int fd, Handler on_readable);
  // Also calls `on_writable` while the descriptor can be written; an empty function ends that.
  void SetOnWritable(int fd, Handler on_writable);
  void RemoveFd(int fd);

  // Calls `handler` every period_s, first after one period. A loop that was busy skips the ticks
  // that it missed. Throws std::invalid_argument unless period_s > 0.
  TimerId AddTimer(double period_s, Handler handler);
  // Calls `handler` once, delay_s from now; again if it throws.
  TimerId AddOneShot(double delay_s, Handler handler);
  // No effect if it is gone already.
  void CancelTimer(TimerId id);

  // Calls `work`. False: an exception was noted, as one of `source`, and logged.
  bool RunNoting(const std::string& source, const Handler& work);
  const Thrown& thrown() const { return thrown_; }

  // Runs `handler` on the loop's thread, soon, in the order of posting. Any thread.
  void Post(Handler handler);

  // From now on SIGINT and SIGTERM stop this loop (one loop a process); interrupted() tells.
  void StopOnSignals();
  bool interrupted() const { return interrupted_; }

  // Runs until Stop, or a signal.
  void Run();
  // Runs until `done` holds, `timeout_s` is over or the loop is stopped. `done` is checked after
  // every event. Returns done().
  bool RunUntil(const std::function<bool()>& done, double timeout_s);
  // Ends Run; a Run that starts later returns at once. Any thread.
  void Stop();

 private:
  struct Descriptor {
    Handler on_readable;
    Handler on_writable;
  };
  struct TimerEntry {
    double period_s;  // 0: once
    double due_s;
    std::shared_ptr<Handler> handler;
  };

  TimerId AddTimerEntry(double first_delay_s, double period_s, Handler handler);
  void RunOnce(double max_wait_s);
  int WaitMs(double max_wait_s) const;
  void RunDescriptors(int wait_ms);
  void CallReady(int fd, short events);
  void RunTimers();
  void RunTimer(TimerId id, double started_s);
  void RunPosted();
  void ReadSignals();

  const Clock clock_;
  std::map<int, std::shared_ptr<Descriptor>> descriptors_;
  std::map<TimerId, TimerEntry> timers_;
  std::set<std::pair<double, TimerId>> due_;  // (due_s, id)
  TimerId next_timer_id_ = 1;
  Thrown thrown_;
  bool interrupted_ = false;
  bool handles_signals_ = false;

  int wake_fd_ = -1;  // eventfd
  std::mutex mutex_;
  std::vector<Handler> posted_;  // guarded by mutex_
  bool stopped_ = false;         // guarded by mutex_
};

}  // namespace skein
