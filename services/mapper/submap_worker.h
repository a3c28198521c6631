#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "event_loop/alive.h"
#include "event_loop/step_record.h"
#include "event_loop/worker_thread.h"
#include "mapping/submap.h"

namespace skein {

// Slots in which threads of a mapper record their steps.
enum StepSlot { kWorkerSlot, kShapeSlot, kWriterSlot };

// A submap and the thread that owns it: every access is a job there. The submaps of one thread take
// turns job by job. Each job is a step (session/submap_steps.h); what throws fails the step. Loop's
// thread only.
class SubmapWorker {
 public:
  using OnFailure = std::function<void(const std::string& step, const std::string& reason)>;

  // `thread`, `current`, the submap whose job was the last to begin, and `steps` outlive this.
  SubmapWorker(WorkerThread& thread, std::atomic<int64_t>& current, StepRecord& steps,
               int64_t submap_id, const SubmapOptions& options, OnFailure on_failure)
      : thread_(thread),
        current_(current),
        steps_(steps),
        submap_id_(submap_id),
        submap_(std::make_shared<Submap>(options)),
        on_failure_(std::move(on_failure)) {}

  // job(Submap&): R on the worker's thread, then(R) on the loop's, unless this is gone by then or
  // the job has thrown.
  template <class Job, class Then>
  void Run(const std::string& step, Job job, Then then) {
    RunOn(
        thread_, kWorkerSlot, step,
        [&current = current_, id = submap_id_, submap = submap_, job = std::move(job)]() mutable {
          current = id;
          return job(*submap);
        },
        std::move(then));
  }

  // job(): R on another thread, which has that slot.
  template <class Job, class Then>
  void RunOn(WorkerThread& thread, StepSlot slot, const std::string& step, Job job, Then then) {
    using R = std::invoke_result_t<Job&>;
    thread.Run([&steps = steps_, slot, step = Step{submap_id_, step},
                job = std::move(job)]() mutable { return Attempt<R>(steps, slot, step, job); },
               alive_.Guarded([this, step, then = std::move(then)](Attempted<R> attempted) mutable {
                 if (!attempted.result) return on_failure_(attempted.failed_step, attempted.reason);
                 try {
                   then(std::move(*attempted.result));
                 } catch (const std::exception& error) {
                   on_failure_(step, error.what());
                 }
               }));
  }

 private:
  template <class R>
  struct Attempted {
    std::optional<R> result;  // none: the step has thrown
    std::string failed_step, reason;
  };

  template <class R, class Job>
  static Attempted<R> Attempt(StepRecord& steps, StepSlot slot, const Step& step, Job& job) {
    Attempted<R> attempted;
    try {
      const StepRecord::Scope scope(&steps, slot, step);
      attempted.result.emplace(job());
      return attempted;
    } catch (const std::exception& error) {
      attempted.reason = error.what();
    } catch (...) {
      attempted.reason = "unknown exception";
    }
    attempted.failed_step = steps.TakeThrown(slot).name;
    return attempted;
  }

  WorkerThread& thread_;
  std::atomic<int64_t>& current_;
  StepRecord& steps_;
  const int64_t submap_id_;
  const std::shared_ptr<Submap> submap_;  // jobs hold it: the last may end after this
  const OnFailure on_failure_;
  Alive alive_;
};

}  // namespace skein
