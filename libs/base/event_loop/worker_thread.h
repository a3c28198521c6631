// One thread for work that would block the loop.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <type_traits>
#include <utility>

#include "event_loop/alive.h"
#include "event_loop/poll_loop.h"

namespace skein {

// Runs jobs one after another on a thread of its own, and each job's `then` on the loop's thread.
// Constructed, used and destroyed on the loop's thread; the loop must outlive it. Destruction waits
// for the running job, discards the waiting ones, and calls no further `then`. An exception of a
// job is rethrown on the loop's thread, which ends the service. So does a job that hangs: one that
// makes no progress for max_quiet_s.
class WorkerThread {
 public:
  // Far above what the steps of a job take. Counted in the loop's own seconds, of which a pause of
  // the process or of the machine is one.
  static constexpr int kMaxQuietS = 300;

  // on_hang: what is done about a job that hangs.
  explicit WorkerThread(PollLoop& loop, int max_quiet_s = kMaxQuietS,
                        std::function<void()> on_hang = EndHungProcess);
  ~WorkerThread();
  WorkerThread(const WorkerThread&) = delete;
  WorkerThread& operator=(const WorkerThread&) = delete;

  // job(): R on the worker's thread, then(R) on the loop's. Both are moved, so they may own
  // what cannot be copied only through a shared_ptr.
  template <class Job, class Then>
  void Run(Job job, Then then) {
    using R = std::invoke_result_t<Job&>;
    if constexpr (std::is_void_v<R>) {
      Enqueue([job = std::move(job), then = std::move(then)]() mutable -> std::function<void()> {
        job();
        return then;
      });
    } else {
      Enqueue([job = std::move(job), then = std::move(then)]() mutable -> std::function<void()> {
        auto result = std::make_shared<R>(job());
        return [result, then]() mutable { then(std::move(*result)); };
      });
    }
  }

  // Notes that a step of the running job is done. Any thread.
  void NoteProgress() { ++num_steps_; }

  // Ends this process by SIGALRM, which the supervisor tells the next one of its name.
  [[noreturn]] static void EndHungProcess();

  // Jobs given whose `then` was not yet called.
  int num_pending() const { return num_pending_; }

 private:
  using WrappedJob = std::function<std::function<void()>()>;

  void Enqueue(WrappedJob job);
  void Work();
  std::function<void()> RunJob(WrappedJob& job);
  void Watch();

  PollLoop& loop_;
  const int max_quiet_s_;
  const std::function<void()> on_hang_;
  int num_pending_ = 0;         // loop's thread only
  int64_t num_steps_seen_ = 0;  // the same
  int quiet_s_ = 0;             // the same: since num_steps_ grew
  PollLoop::TimerId watch_timer_ = 0;
  std::atomic<int64_t> num_steps_{0};  // begun jobs and their steps
  Alive alive_;                        // of what the worker's thread posts

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<WrappedJob> jobs_;  // guarded by mutex_
  bool stop_ = false;            // guarded by mutex_
  std::thread thread_;           // last: starts when the rest stands
};

}  // namespace skein
