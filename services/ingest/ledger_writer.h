#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "ledger/facts.h"
#include "ledger/ledger_store.h"
#include "session/session_history.h"

namespace skein {

// The one place where facts are committed. A staged fact counts for `state()` at once, so the next
// one is judged with it. Flush makes all staged facts durable by one sync of the disk, then tells
// the observers. No other process may learn of a fact before that.
class LedgerWriter {
 public:
  using OnCommitted = std::function<void(const Fact&)>;

  // Replays the ledger. Throws std::runtime_error if it cannot be read or is damaged.
  LedgerWriter(std::unique_ptr<Ledger> ledger, std::string session_id,
               std::function<int64_t()> now_us);

  // Completes the fact (see CompleteFact) and stages it. `then` is called at Flush, after the
  // observers. Returns the completed fact. Throws std::logic_error for a fact_id that exists, and
  // BrokenState where the fact is half staged: `state()` then differs from the ledger.
  Fact Stage(Fact fact, std::vector<LedgerNote> notes = {}, OnCommitted then = nullptr);
  void StageNote(LedgerNote note);
  // If the disk takes no more, all stays staged, nobody is told of it, and problem() says why; a
  // later Flush tries again. A fresh start finds the ledger as it was before. An exception of an
  // observer or a `then` is a BrokenState: those after it would never hear of the facts.
  void Flush();
  const std::string& problem() const { return problem_; }  // for a person; "" if there is none
  bool has_staged() const { return !staged_.empty() || !notes_.empty(); }

  // Called at Flush for every fact in order; may stage more. For the lifetime of the writer.
  void AddObserver(OnCommitted observer) { observers_.push_back(std::move(observer)); }
  // Called when the first fact or note is staged after a Flush: arranges for the next.
  void OnStaged(std::function<void()> arrange_flush) { arrange_flush_ = std::move(arrange_flush); }

  const SessionRecord& session() const { return session_; }
  const SessionState& state() const { return session_.state; }
  const SessionHistory& history() const { return session_.history; }
  int64_t durable_head() const { return ledger_->head(); }
  const std::string& session_id() const { return session_id_; }
  int64_t now_us() const { return now_us_(); }

  std::map<std::string, std::string> Notes(const std::string& kind) const;
  std::vector<LedgerRecord> Range(int64_t from_seq, int64_t to_seq) const;

 private:
  struct Staged {
    Fact fact;
    OnCommitted then;
  };

  void Replay();
  void ArrangeFlush();

  std::unique_ptr<Ledger> ledger_;
  const std::string session_id_;
  const std::function<int64_t()> now_us_;
  SessionRecord session_;
  std::vector<Staged> staged_;
  std::vector<LedgerNote> notes_;
  std::vector<OnCommitted> observers_;
  std::function<void()> arrange_flush_;
  std::string problem_;
};

}  // namespace skein
