#include "event_loop/worker_thread.h"

#include <csignal>
#include <cstdlib>

#include "core/log.h"

namespace skein {
namespace {

constexpr double kWatchS = 1.0;

}  // namespace

WorkerThread::WorkerThread(PollLoop& loop, int max_quiet_s, std::function<void()> on_hang)
    : loop_(loop),
      max_quiet_s_(max_quiet_s),
      on_hang_(std::move(on_hang)),
      thread_([this] { Work(); }) {
  watch_timer_ = loop_.AddTimer(kWatchS, [this] { Watch(); });
}

WorkerThread::~WorkerThread() {
  loop_.CancelTimer(watch_timer_);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void WorkerThread::Enqueue(WrappedJob job) {
  ++num_pending_;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    jobs_.push_back(std::move(job));
  }
  wake_.notify_one();
}

void WorkerThread::Watch() {
  const int64_t num_steps = num_steps_;
  const bool goes_on = num_pending_ == 0 || num_steps != num_steps_seen_;
  num_steps_seen_ = num_steps;
  quiet_s_ = goes_on ? 0 : quiet_s_ + 1;
  if (quiet_s_ >= max_quiet_s_) on_hang_();
}

void WorkerThread::EndHungProcess() {
  LogError("a job has made no progress for {} s; this process ends", kMaxQuietS);
  std::signal(SIGALRM, SIG_DFL);
  std::raise(SIGALRM);
  std::abort();
}

std::function<void()> WorkerThread::RunJob(WrappedJob& job) {
  try {
    return job();
  } catch (...) {
    return [error = std::current_exception()] { std::rethrow_exception(error); };
  }
}

void WorkerThread::Work() {
  while (true) {
    WrappedJob job;
    {
      std::unique_lock<std::mutex> lock(mutex_);
      wake_.wait(lock, [this] { return stop_ || !jobs_.empty(); });
      if (stop_) return;
      job = std::move(jobs_.front());
      jobs_.pop_front();
    }
    NoteProgress();
    loop_.Post(alive_.Guarded([this, then = RunJob(job)] {
      --num_pending_;
      then();
    }));
  }
}

}  // namespace skein
