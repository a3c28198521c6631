#pragma once

#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "event_loop/alive.h"
#include "ledger/facts.h"
#include "ledger/submitter.h"

namespace skein {

// The facts of a run that ingest has not decided on. Loop's thread only; functions are not called
// once it is gone.
class Submissions {
 public:
  using OnCommitted = std::function<void(int64_t seq)>;
  using OnRefused = std::function<void(const std::string& reason)>;

  // on_lease_lost: the submap has ended or is another's; called instead of OnRefused.
  // on_all_decided: nothing is under way any more.
  Submissions(Submitter& submitter, OnRefused on_lease_lost, std::function<void()> on_all_decided);

  // `at_seq`: the item at which the fact was computed.
  void Submit(Fact fact, int64_t at_seq, OnCommitted committed, OnRefused refused);
  // Calls `then` once everything submitted so far is decided; at once if it is.
  void WhenDecided(std::function<void()> then);

  bool empty() const { return under_way_.empty(); }
  // The earliest item of what is under way; there must be some.
  int64_t FirstSeq() const { return *under_way_.begin(); }

 private:
  void OnDone(const Submission& done, int64_t at_seq, const std::string& fact_id,
              const OnCommitted& committed, const OnRefused& refused);

  Submitter& submitter_;
  const OnRefused on_lease_lost_;
  const std::function<void()> on_all_decided_;
  std::multiset<int64_t> under_way_;  // the items' seqs
  std::vector<std::function<void()>> waiting_;
  Alive alive_;
};

}  // namespace skein
