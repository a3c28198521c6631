#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

#include "event_loop/alive.h"
#include "event_loop/worker_thread.h"
#include "mapping/submap.h"

namespace skein {

// A submap and the thread that owns it: every access is a job there. The submaps of one thread take
// turns job by job. Loop's thread only.
class SubmapWorker {
 public:
  // `thread` and `current`, the submap whose job was the last to begin, outlive this.
  SubmapWorker(WorkerThread& thread, std::atomic<int64_t>& current, int64_t submap_id,
               const SubmapOptions& options)
      : thread_(thread),
        current_(current),
        submap_id_(submap_id),
        submap_(std::make_shared<Submap>(options)) {}

  // job(Submap&): R on the worker's thread, then(R) on the loop's, unless this is gone by then.
  template <class Job, class Then>
  void Run(Job job, Then then) {
    thread_.Run(
        [&current = current_, id = submap_id_, submap = submap_, job = std::move(job)]() mutable {
          current = id;
          return job(*submap);
        },
        alive_.Guarded(std::move(then)));
  }

 private:
  WorkerThread& thread_;
  std::atomic<int64_t>& current_;
  const int64_t submap_id_;
  const std::shared_ptr<Submap> submap_;  // jobs hold it: the last may end after this
  Alive alive_;
};

}  // namespace skein
