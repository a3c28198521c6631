#include "http/job_pool.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <system_error>
#include <utility>

#include "core/clock.h"
#include "core/log.h"

namespace skein {

JobPool::JobPool(int num_threads, int num_more, double patience_s)
    : num_threads_(static_cast<size_t>(num_threads)),
      most_threads_(static_cast<size_t>(num_threads + num_more)),
      patience_s_(patience_s) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (size_t i = 0; i < num_threads_; ++i) StartThread();
}

JobPool::~JobPool() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void JobPool::StartThread() {
  threads_.emplace_back([this] { Work(); });
  ++num_idle_;
}

// A thread without a job watches over those that have one, until all threads have.
void JobPool::StartWatch() {
  if (jobs_.empty() || num_idle_ > 0 || threads_.size() >= most_threads_) return;
  try {
    StartThread();
  } catch (const std::system_error& error) {
    LogWarn("requests wait: no thread can be started: {}", error.what());
  }
}

void JobPool::Run(std::function<void()> job) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    jobs_.push_back(std::move(job));
    StartWatch();
  }
  wake_.notify_one();
}

bool JobPool::MayBegin(double now_s) const {
  if (jobs_.empty()) return false;
  const auto num_stuck = std::count_if(running_.begin(), running_.end(), [&](double since_s) {
    return now_s - since_s >= patience_s_;
  });
  return running_.size() - static_cast<size_t>(num_stuck) < num_threads_;
}

// How long until one of the running jobs counts no longer; none: negative.
double JobPool::LeftS(double now_s) const {
  for (const double since_s : running_) {
    if (now_s - since_s < patience_s_) return since_s + patience_s_ - now_s;
  }
  return -1;
}

void JobPool::Wait(std::unique_lock<std::mutex>* lock) {
  while (!stop_) {
    const double now_s = MonotonicS();
    if (MayBegin(now_s)) return;
    const double left_s = jobs_.empty() ? -1 : LeftS(now_s);
    if (left_s < 0) {
      wake_.wait(*lock);
    } else {
      wake_.wait_for(*lock, std::chrono::duration<double>(left_s));
    }
  }
}

void JobPool::Work() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    Wait(&lock);
    if (stop_) return;
    std::function<void()> job = std::move(jobs_.front());
    jobs_.pop_front();
    --num_idle_;
    const auto mine = running_.insert(running_.end(), MonotonicS());
    StartWatch();
    lock.unlock();
    wake_.notify_one();
    try {
      job();
    } catch (const std::exception& error) {
      LogError("a request failed: {}", error.what());
    }
    job = nullptr;  // what it held may give a job
    lock.lock();
    running_.erase(mine);
    ++num_idle_;
  }
}

}  // namespace skein
