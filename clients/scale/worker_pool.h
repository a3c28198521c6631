// When worker jobs are submitted, and which of them leave.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/result.h"

namespace skein {

// A job as its engine lists it. The name is the worker's: "wEXPIRY-NUMBER", where EXPIRY is when
// its invitation ends, in seconds since 1970 UTC as hexadecimal digits.
struct WorkerJob {
  std::string name;
  bool is_running = false;  // false: it waits in the engine's queue
  std::string reason;       // why it waits, in the engine's words
};

std::string WorkerName(int64_t expiry_utime_s, int number);
// 0 for a name of another form.
int64_t ExpiryOfWorker(const std::string& name);

// A worker's processes as their heartbeats tell them.
struct HeardWorker {
  double heard_s = 0;   // monotonic, the latest
  int64_t backlog = 0;  // items that it has in work
};
using HeardWorkers = std::map<std::string, HeardWorker>;  // by worker

struct PoolTime {
  double monotonic_s = 0;
  int64_t utime_s = 0;  // since 1970 UTC
};

// Decides without I/O: jobs, heartbeats and time are arguments. The state is rebuilt from the
// engine's list and the heartbeats, so after a restart the pool goes on with the running workers.
class WorkerPool {
 public:
  static constexpr double kIdleAfterS = 60;

  struct Plan {
    int num_new = 0;
    std::vector<std::string> leaving;
    std::vector<std::string> told;  // lines for a person
  };

  // Spare workers leave once fewer are wanted for `idle_after_s`.
  explicit WorkerPool(double idle_after_s = kIdleAfterS) : idle_after_s_(idle_after_s) {}

  // At each listing. Expired, silent and spare workers leave; of spare ones first those that wait,
  // then those with the least in work.
  Plan Decide(const std::vector<WorkerJob>& jobs, const HeardWorkers& heard, int wanted,
              const PoolTime& now);
  // Result of a submission. Ok: the jobs count from now on. Error: the next submission waits, twice
  // as long after each error in a row.
  void OnSubmitted(const std::vector<std::string>& names, const Status& status, double now_s);
  // Result of a cancellation. Error: the workers are in `leaving` of a later plan again, after a
  // pause that doubles each time, until the engine cancels them or no longer lists them.
  void OnCancelled(const std::vector<std::string>& names, const Status& status, double now_s);

  int num_running() const { return num_running_; }
  int num_waiting() const { return num_waiting_; }
  // Trouble that a person has to mend, "" if there is none.
  const std::string& problem() const { return problem_; }
  // Reason of the engine's last refusal to cancel; "" if no worker waits to be cancelled again.
  std::string uncancelled() const;

 private:
  struct Life {
    double since_s = 0;   // submitted or first seen
    double ran_s = -1;    // first seen running
    double heard_s = -1;  // last heard
    int64_t backlog = 0;
    bool is_running = false;
    bool is_leaving = false;
    double cancel_again_s = -1;  // due then, after a refusal; -1: none
    int num_uncancelled = 0;     // refusals
    std::string reason;
  };

  void See(const std::vector<WorkerJob>& jobs, const HeardWorkers& heard, double now_s);
  void Forget(const std::vector<WorkerJob>& jobs, double now_s, Plan* plan);
  void GiveUp(const PoolTime& now, Plan* plan);
  void CancelAgain(double now_s, Plan* plan) const;
  void Leave(const std::string& name, const std::string& why, Plan* plan);
  void Grow(int num_missing, double now_s, Plan* plan);
  void Shrink(int num_spare, double now_s, Plan* plan);
  void NoteUnheard(double now_s);
  void NoteFailure(double now_s);
  void Count(double now_s);

  const double idle_after_s_;
  std::map<std::string, Life> lives_;
  int num_running_ = 0;
  int num_waiting_ = 0;
  int num_failures_ = 0;     // refused or unheard, one after the other
  int num_unheard_ = 0;      // of these
  double not_before_s_ = 0;  // of the next submission
  double short_since_s_ = -1;
  double spare_since_s_ = -1;
  std::string refusal_;  // of the last submission
  std::string problem_;
  std::string cancel_refusal_;  // the last one
};

}  // namespace skein
