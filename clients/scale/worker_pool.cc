#include "clients/scale/worker_pool.h"

#include <algorithm>
#include <cstdio>
#include <tuple>

#include "core/counted.h"

namespace skein {
namespace {

constexpr double kGrowAfterS = 5;  // for so long more workers are wanted than there are
// A running worker that falls silent is given up; one never heard after twice that.
constexpr double kSilentS = 60;
constexpr double kQueuePatienceS = 120;  // a job that waits for so long is told
constexpr double kListedWithinS = 15;    // a job that was submitted
constexpr double kFirstDelayS = 10, kLongestDelayS = 300;
constexpr int kMostDoublings = 5;
// A worker that starts so late would hardly have begun.
constexpr int64_t kLeastInvitationS = 60;

std::string Workers(size_t count) { return Counted(count, "worker"); }

// Until the next try, after so many earlier ones.
double DelayS(int num_before) {
  return std::min(kFirstDelayS * (1 << std::min(num_before, kMostDoublings)), kLongestDelayS);
}

}  // namespace

std::string WorkerName(int64_t expiry_utime_s, int number) {
  char text[32];
  std::snprintf(text, sizeof(text), "w%llx-%d", static_cast<unsigned long long>(expiry_utime_s),
                number);
  return text;
}

int64_t ExpiryOfWorker(const std::string& name) {
  unsigned long long expiry_utime_s = 0;
  int number = 0, size = 0;
  const int read = std::sscanf(name.c_str(), "w%10llx-%d%n", &expiry_utime_s, &number, &size);
  return read == 2 && static_cast<size_t>(size) == name.size()
             ? static_cast<int64_t>(expiry_utime_s)
             : 0;
}

WorkerPool::Plan WorkerPool::Decide(const std::vector<WorkerJob>& jobs, const HeardWorkers& heard,
                                    int wanted, const PoolTime& now) {
  Plan plan;
  See(jobs, heard, now.monotonic_s);
  Forget(jobs, now.monotonic_s, &plan);
  CancelAgain(now.monotonic_s, &plan);
  GiveUp(now, &plan);
  const auto num_kept = static_cast<int>(std::count_if(
      lives_.begin(), lives_.end(), [](const auto& entry) { return !entry.second.is_leaving; }));
  Grow(wanted - num_kept, now.monotonic_s, &plan);
  Shrink(num_kept - wanted, now.monotonic_s, &plan);
  Count(now.monotonic_s);
  return plan;
}

void WorkerPool::See(const std::vector<WorkerJob>& jobs, const HeardWorkers& heard, double now_s) {
  for (const WorkerJob& job : jobs) {
    const auto [entry, is_new] = lives_.try_emplace(job.name);
    Life& life = entry->second;
    if (is_new) life.since_s = now_s;
    if (job.is_running && life.ran_s < 0) life.ran_s = now_s;
    life.is_running = job.is_running;
    life.reason = job.reason;
    const auto found = heard.find(job.name);
    if (found == heard.end()) continue;
    if (life.heard_s < 0) num_failures_ = num_unheard_ = 0;
    life.heard_s = found->second.heard_s;
    life.backlog = found->second.backlog;
  }
}

// A job that is not listed any more has ended; one that is not listed yet was just submitted.
void WorkerPool::Forget(const std::vector<WorkerJob>& jobs, double now_s, Plan* plan) {
  for (auto it = lives_.begin(); it != lives_.end();) {
    const auto& [name, life] = *it;
    const bool is_listed = std::any_of(
        jobs.begin(), jobs.end(), [&name = name](const auto& job) { return job.name == name; });
    const bool may_come = life.ran_s < 0 && now_s - life.since_s < kListedWithinS;
    if (is_listed || (may_come && !life.is_leaving)) {
      ++it;
      continue;
    }
    if (!life.is_leaving && life.heard_s < 0) {
      plan->told.push_back("worker " + name + " ended before it was heard; its log tells why");
      NoteUnheard(now_s);
    } else if (!life.is_leaving) {
      plan->told.push_back("worker " + name + " has ended, and was not told to");
    }
    it = lives_.erase(it);
  }
}

void WorkerPool::GiveUp(const PoolTime& now, Plan* plan) {
  for (auto& [name, life] : lives_) {
    if (life.is_leaving) continue;
    const int64_t left_s = ExpiryOfWorker(name) - now.utime_s;
    if (left_s < (life.is_running ? 0 : kLeastInvitationS)) {
      Leave(name,
            life.is_running ? "its invitation has ended"
                            : "its invitation ended while it waited in the queue",
            plan);
    } else if (life.is_running && life.heard_s < 0) {
      if (now.monotonic_s - life.ran_s <= 2 * kSilentS) continue;
      NoteUnheard(now.monotonic_s);
      Leave(name, "it runs and was never heard: does its node reach the session?", plan);
    } else if (life.is_running && now.monotonic_s - life.heard_s > kSilentS) {
      Leave(name, "it is silent: its node may be down", plan);
    }
  }
}

void WorkerPool::CancelAgain(double now_s, Plan* plan) const {
  for (const auto& [name, life] : lives_) {
    if (life.cancel_again_s >= 0 && now_s >= life.cancel_again_s) plan->leaving.push_back(name);
  }
}

void WorkerPool::Leave(const std::string& name, const std::string& why, Plan* plan) {
  lives_[name].is_leaving = true;
  plan->leaving.push_back(name);
  if (!why.empty()) plan->told.push_back("worker " + name + " is cancelled: " + why);
}

void WorkerPool::Grow(int num_missing, double now_s, Plan* plan) {
  if (num_missing <= 0) {
    short_since_s_ = -1;
    return;
  }
  if (short_since_s_ < 0) short_since_s_ = now_s;
  if (now_s - short_since_s_ >= kGrowAfterS && now_s >= not_before_s_) {
    plan->num_new = num_missing;
  }
}

void WorkerPool::Shrink(int num_spare, double now_s, Plan* plan) {
  if (num_spare <= 0) {
    spare_since_s_ = -1;
    return;
  }
  if (spare_since_s_ < 0) spare_since_s_ = now_s;
  if (now_s - spare_since_s_ < idle_after_s_) return;
  std::vector<std::tuple<bool, int64_t, std::string>> kept;
  for (const auto& [name, life] : lives_) {
    if (!life.is_leaving) kept.emplace_back(life.is_running, life.backlog, name);
  }
  std::sort(kept.begin(), kept.end());
  kept.resize(static_cast<size_t>(num_spare));
  for (const auto& [is_running, backlog, name] : kept) Leave(name, "", plan);
  plan->told.push_back("tells " + Workers(kept.size()) + " to leave: spare");
  spare_since_s_ = -1;
}

void WorkerPool::OnSubmitted(const std::vector<std::string>& names, const Status& status,
                             double now_s) {
  refusal_ = status.error();
  if (!status.ok()) NoteFailure(now_s);
  for (const std::string& name : names) {
    if (status.ok()) lives_[name].since_s = now_s;
  }
  short_since_s_ = -1;
  Count(now_s);
}

void WorkerPool::OnCancelled(const std::vector<std::string>& names, const Status& status,
                             double now_s) {
  if (!status.ok()) cancel_refusal_ = status.error();
  for (const std::string& name : names) {
    const auto found = lives_.find(name);
    if (found == lives_.end()) continue;
    Life& life = found->second;
    life.cancel_again_s = status.ok() ? -1 : now_s + DelayS(life.num_uncancelled++);
  }
}

std::string WorkerPool::uncancelled() const {
  const bool waits = std::any_of(lives_.begin(), lives_.end(), [](const auto& entry) {
    return entry.second.cancel_again_s >= 0;
  });
  return waits ? cancel_refusal_ : "";
}

void WorkerPool::NoteUnheard(double now_s) {
  ++num_unheard_;
  NoteFailure(now_s);
}

void WorkerPool::NoteFailure(double now_s) { not_before_s_ = now_s + DelayS(num_failures_++); }

void WorkerPool::Count(double now_s) {
  num_running_ = num_waiting_ = 0;
  bool is_heard = false;
  const Life* oldest = nullptr;
  for (const auto& [name, life] : lives_) {
    if (life.is_leaving) continue;
    ++(life.is_running ? num_running_ : num_waiting_);
    is_heard = is_heard || life.heard_s >= 0;
    const bool waits = !life.is_running;
    if (waits && (oldest == nullptr || life.since_s < oldest->since_s)) oldest = &life;
  }
  problem_ = refusal_;
  if (oldest != nullptr && !is_heard && now_s - oldest->since_s > kQueuePatienceS) {
    problem_ = "worker jobs wait in the queue and none starts (" + oldest->reason + ")";
  } else if (num_unheard_ > 1 && !is_heard) {
    problem_ = "worker jobs start and are not heard; their logs tell why";
  }
}

}  // namespace skein
