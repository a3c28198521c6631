#include "clients/trouble_watch.h"

#include <utility>

#include "clients/ingest_watch.h"
#include "photo/photo_name.h"

namespace skein {
namespace {

constexpr size_t kMaxSentenceBytes = 400;

std::string Sentence(const std::string& text) { return Printable(text, kMaxSentenceBytes); }

}  // namespace

// Before the processes had time to be heard nothing is lacking.
void TroubleWatch::FollowLedger() {
  const bool is_wanted = heard_.listened_s() >= kSilentProcessS &&
                         LacksWorker(heard_.processes(), node_.loop().now_s());
  if (!is_wanted) {
    follower_.reset();
    state_ = {};
    has_read_ledger_ = false;
  } else if (!follower_) {
    follower_ = std::make_unique<LedgerFollower>(node_, 1,
                                                 [this](const Fact& fact) { state_.Apply(fact); });
  }
  has_read_ledger_ = has_read_ledger_ || (follower_ && follower_->caught_up());
}

std::vector<Trouble> TroubleWatch::Find() {
  FollowLedger();
  return FindTroubles(has_read_ledger_ ? state_ : SessionState(), heard_.processes(),
                      node_.loop().now_s(), heard_.listened_s());
}

void TroubleWatch::TellChange(const std::string& command, std::ostream& out) {
  std::map<std::string, std::string> present;
  for (const Trouble& trouble : Find()) {
    const auto told = told_.find(trouble.key);
    const bool is_new = told == told_.end() && present.count(trouble.key) == 0;
    present.emplace(trouble.key, told == told_.end() ? Sentence(trouble.what) : told->second);
    if (!is_new) continue;
    out << command << ": " << Sentence(trouble.what) << " " << Sentence(trouble.remedy);
    if (trouble.key == kSilentIngest) out << " (" << NoSignOfIngest(node_) << ")";
    out << std::endl;
  }
  for (const auto& [key, what] : told_) {
    if (present.count(key) == 0) out << command << ": over: " << what << std::endl;
  }
  told_ = std::move(present);
}

}  // namespace skein
