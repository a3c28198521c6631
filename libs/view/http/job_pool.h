#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <list>
#include <mutex>
#include <thread>
#include <vector>

namespace skein {

// Threads for jobs that read and write files, decode and compress. Any thread gives jobs. Jobs
// begin in the order in which they came.
class JobPool {
 public:
  // At most `num_threads` jobs at a time. A job that has run
  // for `patience_s`, e.g. because the disk does not answer, counts no longer, so that others go
  // on: on at most `num_more` further threads, which are started once they are needed.
  explicit JobPool(int num_threads, int num_more = 0, double patience_s = 1);
  // Waits for the running jobs and discards the others.
  ~JobPool();
  JobPool(const JobPool&) = delete;
  JobPool& operator=(const JobPool&) = delete;

  // An exception of a job is logged.
  void Run(std::function<void()> job);

 private:
  void Work();
  void Wait(std::unique_lock<std::mutex>* lock);
  bool MayBegin(double now_s) const;
  double LeftS(double now_s) const;
  void StartThread();
  void StartWatch();

  const size_t num_threads_, most_threads_;
  const double patience_s_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> jobs_;  // guarded by mutex_
  std::list<double> running_;               // guarded by mutex_; since when, longest first
  size_t num_idle_ = 0;                     // guarded by mutex_
  bool stop_ = false;                       // guarded by mutex_
  std::vector<std::thread> threads_;        // guarded by mutex_ until stop_
};

}  // namespace skein
