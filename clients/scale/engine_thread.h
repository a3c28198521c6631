// One thread for an engine, whose calls block.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "clients/scale/engine.h"
#include "clients/scale/worker_pool.h"
#include "core/result.h"
#include "event_loop/worker_thread.h"

namespace skein {

// Owns an engine and calls it on a thread of its own, one call after another. Each `then` runs on
// the loop's thread. Constructed, used and destroyed there; the loop must outlive it.
class EngineThread {
 public:
  using Jobs = Result<std::vector<WorkerJob>>;

  EngineThread(PollLoop& loop, std::unique_ptr<Engine> engine);

  // Whether a call runs or waits for its turn.
  bool is_busy() const { return worker_.num_pending() > 0; }

  void List(std::function<void(const Jobs&)> then);
  // As Engine::Submit.
  void Submit(const std::string& batch, const std::vector<std::string>& invitations,
              const std::vector<std::string>& job_options,
              const std::vector<std::string>& launch_options,
              std::function<void(const Status&)> then);
  void Cancel(const std::vector<std::string>& workers, std::function<void(const Status&)> then);

  // Before the loop runs.
  Jobs ListAndWait();
  // After the loop has ended: waits for the calls that were begun, then cancels all workers that
  // the engine lists. Returns their number.
  Result<size_t> CancelAllAndWait();

 private:
  template <class Job>
  auto RunAndWait(Job job);

  const std::unique_ptr<Engine> engine_;  // used by worker_ alone
  WorkerThread worker_;                   // last: ends first
};

}  // namespace skein
