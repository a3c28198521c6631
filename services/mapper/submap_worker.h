#pragma once

#include <memory>
#include <utility>

#include "event_loop/alive.h"
#include "event_loop/worker_thread.h"
#include "mapping/submap.h"

namespace skein {

// A submap and the thread that owns it: every access is a job there. Loop's thread only.
class SubmapWorker {
 public:
  // The thread outlives this.
  SubmapWorker(WorkerThread& thread, const SubmapOptions& options)
      : thread_(thread), submap_(std::make_shared<Submap>(options)) {}

  // job(Submap&): R on the worker's thread, then(R) on the loop's, unless this is gone by then.
  template <class Job, class Then>
  void Run(Job job, Then then) {
    thread_.Run([submap = submap_, job = std::move(job)]() mutable { return job(*submap); },
                alive_.Guarded(std::move(then)));
  }

 private:
  WorkerThread& thread_;
  const std::shared_ptr<Submap> submap_;  // jobs hold it: the last may end after this
  Alive alive_;
};

}  // namespace skein
