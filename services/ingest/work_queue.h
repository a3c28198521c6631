#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace skein {

// A lease of work. Workers renew it once a second (node/work_client.h): it lapses if six messages
// in a row are lost.
constexpr double kLeaseS = 6;

// Items of one kind of work and their holders. Knows no messages and no clock: `now_s` is any
// monotonic time and is passed in. The items come from the ledger (Add, Remove), so nothing here
// must survive a restart. A worker that names an item it holds gets it back.
class WorkQueue {
 public:
  struct Grant {
    std::string worker;
    int64_t item = 0;
    int attempt = 1;
    bool is_new = true;  // false: told again
  };
  // A try that failed; the item is parked, or tried again later.
  struct Failure {
    int64_t item = 0;
    std::string worker;
    std::string reason;
    int attempts = 0;
    bool parked = false;
  };
  struct Request {
    std::string worker;
    int capacity = 0;              // further items it can take; below 0: the worker leaves
    int previous_exit_signal = 0;  // of the process that had the worker's name before
    std::vector<int64_t> held;     // the one being worked on first
  };

  // Whether a worker that names an item which waits may go on with it; unset: yes.
  using MayResume = std::function<bool(const std::string& worker, int64_t item)>;

  // A lease lapses when its worker hasn't named the item for `lease_s`.
  explicit WorkQueue(double lease_s = kLeaseS, MayResume may_resume = nullptr)
      : lease_s_(lease_s), may_resume_(std::move(may_resume)) {}

  // No effect if it is there.
  void Add(int64_t item);
  void Remove(int64_t item);  // done or parked
  // Number of failures in earlier tries, from the ledger.
  void NoteEarlier(int64_t item, int failures);
  // The worker is known to have it: starts a lease, unless it has one. No effect on unknown items.
  void Lease(int64_t item, const std::string& worker, double now_s);

  // Renews, notes capacity, and notices what the worker's previous process died of. The items of a
  // worker that leaves wait again.
  std::vector<Failure> OnRequest(const Request& request, double now_s);
  // A reported error; nothing if the worker has no lease on the item (a repeat of the report).
  std::vector<Failure> OnFailed(const std::string& worker, int64_t item, const std::string& reason,
                                bool permanent, double now_s);

  // The worker gives an item back that another try may do; nothing if it has no lease on it.
  void Return(const std::string& worker, int64_t item, double now_s);

  // Lets leases lapse, and grants waiting items, oldest first, to workers with capacity. Call it
  // after every change and at least once a second. Includes unconfirmed grants to be repeated.
  std::vector<Grant> Assign(double now_s);

  size_t num_waiting() const { return waiting_.size(); }
  size_t num_leased() const { return leases_.size(); }
  bool Has(int64_t item) const { return waiting_.count(item) > 0 || leases_.count(item) > 0; }

 private:
  struct LeaseState {
    std::string worker;
    double expires_s = 0;
    double told_s = 0;
    bool confirmed = false;
  };
  struct Worker {
    int capacity = 0;
    double seen_s = 0;
    std::vector<int64_t> held;
  };
  struct History {
    int failures = 0;
    int kills = 0;
    double not_before_s = 0;
  };

  std::vector<Failure> NoteDeath(const Worker& before, const Request& request, double now_s);
  std::vector<Failure> NoteFailure(const std::string& worker, int64_t item,
                                   const std::string& reason, bool permanent, double now_s);
  void Renew(const Request& request, double now_s);
  void Leave(const std::string& worker);
  void ReleaseUnnamed(const Request& request);
  void Release(int64_t item);
  bool TakeBack(const std::string& worker, int64_t item);
  void ReleaseLapsed(double now_s);
  bool IsSilent(const Worker& worker, double now_s) const;
  int FreeSlots(const std::string& name, const Worker& worker) const;
  std::string MostFree(double now_s) const;

  const double lease_s_;
  const MayResume may_resume_;
  std::set<int64_t> waiting_;  // ids grow with age, so the order is oldest first
  std::map<int64_t, LeaseState> leases_;
  std::map<int64_t, History> history_;  // of items that failed
  std::map<std::string, Worker> workers_;
};

// "SIGSEGV" for 11; "signal 35" for others.
std::string SignalName(int signal);

}  // namespace skein
