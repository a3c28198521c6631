#include "mapper/submissions.h"

#include <utility>

#include "core/log.h"

namespace skein {

Submissions::Submissions(Submitter& submitter, OnRefused on_lease_lost,
                         std::function<void()> on_all_decided)
    : submitter_(submitter),
      on_lease_lost_(std::move(on_lease_lost)),
      on_all_decided_(std::move(on_all_decided)) {}

void Submissions::Submit(Fact fact, int64_t at_seq, OnCommitted committed, OnRefused refused) {
  Header(fact).computed_at_seq = at_seq;
  under_way_.insert(at_seq);
  const std::string fact_id = Header(fact).fact_id;
  submitter_.Submit(std::move(fact), alive_.Guarded([=](const Submission& done) {
    OnDone(done, at_seq, fact_id, committed, refused);
  }));
}

void Submissions::WhenDecided(std::function<void()> then) {
  if (empty()) return then();
  waiting_.push_back(std::move(then));
}

void Submissions::OnDone(const Submission& done, int64_t at_seq, const std::string& fact_id,
                         const OnCommitted& committed, const OnRefused& refused) {
  under_way_.erase(under_way_.find(at_seq));
  if (done.state == Submission::State::kNotLeased) return on_lease_lost_(done.reason);
  if (!done.committed()) LogWarn("{} refused: {}", fact_id, done.reason);
  done.committed() ? committed(done.seq) : refused(done.reason);
  if (!empty()) return;
  on_all_decided_();
  for (const auto& next : std::exchange(waiting_, {})) next();
}

}  // namespace skein
