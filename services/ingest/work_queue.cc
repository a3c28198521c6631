#include "ingest/work_queue.h"

#include <algorithm>
#include <csignal>

#include "core/attempt.h"
#include "event_loop/exit_signal.h"

namespace skein {
namespace {

constexpr double kSilentS = 3;  // a worker that hasn't asked (at 1 Hz) for so long gets nothing new
constexpr double kRetryDelayS = 1;  // from a reported failure to the next try
constexpr double kResendS = 0.5;    // a grant that isn't confirmed after this is told again

}  // namespace

std::string SignalName(int signal) {
  static const std::map<int, const char*> kNames = {
      {SIGSEGV, "SIGSEGV"}, {SIGABRT, "SIGABRT"},
      {SIGBUS, "SIGBUS"},   {SIGFPE, "SIGFPE"},
      {SIGILL, "SIGILL"},   {SIGKILL, "SIGKILL"},
      {SIGTERM, "SIGTERM"}, {SIGALRM, "SIGALRM: its job made no progress"}};
  const auto found = kNames.find(signal);
  return found != kNames.end() ? found->second : "signal " + std::to_string(signal);
}

void WorkQueue::Add(int64_t item) {
  if (!Has(item)) waiting_.insert(item);
}

void WorkQueue::NoteEarlier(int64_t item, int failures) {
  if (!Has(item)) return;
  int& known = history_[item].failures;
  known = std::max(known, failures);
}

void WorkQueue::Lease(int64_t item, const std::string& worker, double now_s) {
  if (!Has(item)) return;
  const auto found = leases_.find(item);
  if (found != leases_.end() && found->second.worker == worker) return;
  waiting_.erase(item);
  leases_[item] = {worker, now_s + lease_s_, now_s, false};
}

void WorkQueue::Remove(int64_t item) {
  waiting_.erase(item);
  leases_.erase(item);
  history_.erase(item);
}

std::vector<WorkQueue::Failure> WorkQueue::OnRequest(const Request& request, double now_s) {
  Worker& worker = workers_[request.worker];
  std::vector<Failure> failures = NoteDeath(worker, request, now_s);
  if (request.capacity < 0) {
    Leave(request.worker);
    return failures;
  }
  worker.capacity = request.capacity;
  worker.seen_s = now_s;
  worker.held = request.held;
  Renew(request, now_s);
  return failures;
}

// The item in front when the previous process died is the one it was working on. What that process
// held and the new one doesn't name is free at once.
std::vector<WorkQueue::Failure> WorkQueue::NoteDeath(const Worker& before, const Request& request,
                                                     double now_s) {
  std::vector<Failure> failures;
  if (request.previous_exit_signal == 0) return failures;
  const auto still_held = [&](int64_t item) {
    return std::count(request.held.begin(), request.held.end(), item) > 0;
  };
  for (size_t i = 0; i < before.held.size(); ++i) {
    const int64_t item = before.held[i];
    if (still_held(item) || !Has(item)) continue;
    const auto lease = leases_.find(item);
    if (lease != leases_.end() && lease->second.worker == request.worker) Release(item);
    if (i > 0) continue;
    const int signal = request.previous_exit_signal;
    const std::string name = SignalName(signal);
    if (IsCrash(signal)) {
      failures = NoteFailure(request.worker, item, "worker died of " + name, false, now_s);
    } else if (signal == SIGKILL && ++history_[item].kills >= kMaxKills) {
      failures =
          NoteFailure(request.worker, item, "kills its worker (out of memory?)", true, now_s);
    }
  }
  return failures;
}

void WorkQueue::Renew(const Request& request, double now_s) {
  for (const int64_t item : request.held) {
    const bool may_resume = !may_resume_ || may_resume_(request.worker, item);
    if (may_resume && waiting_.erase(item) > 0) leases_[item] = {request.worker, 0, now_s, true};
    const auto lease = leases_.find(item);
    if (lease == leases_.end() || lease->second.worker != request.worker) continue;
    lease->second.expires_s = now_s + lease_s_;
    lease->second.confirmed = true;
  }
  if (request.capacity <= 0) ReleaseUnnamed(request);
}

void WorkQueue::Leave(const std::string& worker) {
  std::vector<int64_t> items;
  for (const auto& [item, lease] : leases_) {
    if (lease.worker == worker) items.push_back(item);
  }
  for (const int64_t item : items) Release(item);
  workers_.erase(worker);
}

// A worker that takes nothing further has not taken what it doesn't name: it is leaving.
void WorkQueue::ReleaseUnnamed(const Request& request) {
  std::vector<int64_t> unnamed;
  for (const auto& [item, lease] : leases_) {
    const bool named = std::count(request.held.begin(), request.held.end(), item) > 0;
    if (lease.worker == request.worker && !lease.confirmed && !named) unnamed.push_back(item);
  }
  for (const int64_t item : unnamed) Release(item);
}

std::vector<WorkQueue::Failure> WorkQueue::OnFailed(const std::string& worker, int64_t item,
                                                    const std::string& reason, bool permanent,
                                                    double now_s) {
  if (!TakeBack(worker, item)) return {};
  return NoteFailure(worker, item, reason, permanent, now_s);
}

void WorkQueue::Return(const std::string& worker, int64_t item, double now_s) {
  if (TakeBack(worker, item)) history_[item].not_before_s = now_s + kRetryDelayS;
}

// False if the worker has no lease on it.
bool WorkQueue::TakeBack(const std::string& worker, int64_t item) {
  const auto lease = leases_.find(item);
  if (lease == leases_.end() || lease->second.worker != worker) return false;
  Release(item);
  auto& held = workers_[worker].held;
  held.erase(std::remove(held.begin(), held.end(), item), held.end());
  return true;
}

std::vector<WorkQueue::Failure> WorkQueue::NoteFailure(const std::string& worker, int64_t item,
                                                       const std::string& reason, bool permanent,
                                                       double now_s) {
  History& history = history_[item];
  ++history.failures;
  history.not_before_s = now_s + kRetryDelayS;
  const Failure failure{item, worker, reason, history.failures,
                        permanent || history.failures >= kMaxFailures};
  if (failure.parked) Remove(item);
  return {failure};
}

void WorkQueue::Release(int64_t item) {
  leases_.erase(item);
  waiting_.insert(item);
}

bool WorkQueue::IsSilent(const Worker& worker, double now_s) const {
  return now_s - worker.seen_s > std::min(kSilentS, lease_s_);
}

// What a worker has not confirmed it has not begun, unless it is about to say so: once it is silent
// another one takes it. A worker that has not asked since ingest began keeps what the ledger says.
void WorkQueue::ReleaseLapsed(double now_s) {
  std::vector<int64_t> lapsed;
  for (const auto& [item, lease] : leases_) {
    const auto worker = workers_.find(lease.worker);
    const bool never_taken =
        !lease.confirmed && worker != workers_.end() && IsSilent(worker->second, now_s);
    if (lease.expires_s <= now_s || never_taken) lapsed.push_back(item);
  }
  for (const int64_t item : lapsed) Release(item);
}

// What it was granted and hasn't confirmed yet counts against what it said it can take.
int WorkQueue::FreeSlots(const std::string& name, const Worker& worker) const {
  int free = worker.capacity;
  for (const auto& [item, lease] : leases_) {
    const bool named = std::count(worker.held.begin(), worker.held.end(), item) > 0;
    if (lease.worker == name && !named) --free;
  }
  return free;
}

std::string WorkQueue::MostFree(double now_s) const {
  std::string best;
  int best_free = 0;
  size_t best_held = 0;
  for (const auto& [name, worker] : workers_) {
    if (IsSilent(worker, now_s)) continue;
    const int free = FreeSlots(name, worker);
    const size_t held = worker.held.size() + static_cast<size_t>(worker.capacity - free);
    if (free <= 0) continue;
    if (best.empty() || held < best_held || (held == best_held && free > best_free)) {
      best = name;
      best_free = free;
      best_held = held;
    }
  }
  return best;
}

std::vector<WorkQueue::Grant> WorkQueue::Assign(double now_s) {
  ReleaseLapsed(now_s);
  const auto attempt = [&](int64_t item) {
    const auto found = history_.find(item);
    return 1 + (found == history_.end() ? 0 : found->second.failures);
  };
  std::vector<Grant> grants;
  for (auto& [item, lease] : leases_) {
    if (lease.confirmed || now_s - lease.told_s < kResendS) continue;
    lease.told_s = now_s;
    grants.push_back({lease.worker, item, attempt(item), false});
  }
  for (auto next = waiting_.begin(); next != waiting_.end();) {
    const int64_t item = *next;
    const auto history = history_.find(item);
    if (history != history_.end() && history->second.not_before_s > now_s) {
      ++next;
      continue;
    }
    const std::string worker = MostFree(now_s);
    if (worker.empty()) break;
    next = waiting_.erase(next);
    leases_[item] = {worker, now_s + lease_s_, now_s, false};
    grants.push_back({worker, item, attempt(item), true});
  }
  return grants;
}

}  // namespace skein
