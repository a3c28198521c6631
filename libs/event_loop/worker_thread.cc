#include "event_loop/worker_thread.h"

namespace skein {

WorkerThread::WorkerThread(PollLoop& loop) : loop_(loop), thread_([this] { Work(); }) {}

WorkerThread::~WorkerThread() {
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
    loop_.Post(alive_.Guarded([this, then = RunJob(job)] {
      --num_pending_;
      then();
    }));
  }
}

}  // namespace skein
