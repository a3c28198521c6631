#include "ingest/ledger_writer.h"

#include <stdexcept>
#include <utility>

#include "core/attempt.h"
#include "core/log.h"
#include "ingest/submission_rules.h"
#include "ledger/ledger_record.h"

namespace skein {
LedgerWriter::LedgerWriter(std::unique_ptr<Ledger> ledger, std::string session_id,
                           std::function<int64_t()> now_us)
    : ledger_(std::move(ledger)), session_id_(std::move(session_id)), now_us_(std::move(now_us)) {
  Replay();
}

void LedgerWriter::Replay() {
  const Status status = ledger_->ForEach([&](const LedgerRecord& record) {
    const Result<Fact> fact = DecodeRecord(record);
    if (!fact.ok()) throw std::runtime_error(fact.error());
    if (Header(*fact).session_id != session_id_) {
      throw std::runtime_error("session.json has the id " + session_id_ + ", the ledger " +
                               Header(*fact).session_id + "; run `skein repair`");
    }
    session_.Apply(*fact);
  });
  if (!status.ok()) throw std::runtime_error(status.error());
}

Fact LedgerWriter::Stage(Fact fact, std::vector<LedgerNote> notes, OnCommitted then) {
  if (history().FindFact(Header(fact).fact_id) != 0) {
    throw std::logic_error("fact " + Header(fact).fact_id + " exists");
  }
  Header(fact).session_id = session_id_;
  CompleteFact(&fact, state(), now_us_());
  ChangeWhole([&] {
    session_.Apply(fact);
    ArrangeFlush();
    notes_.insert(notes_.end(), notes.begin(), notes.end());
    staged_.push_back({std::move(fact), std::move(then)});
  });
  return staged_.back().fact;
}

void LedgerWriter::StageNote(LedgerNote note) {
  ArrangeFlush();
  notes_.push_back(std::move(note));
}

void LedgerWriter::ArrangeFlush() {
  if (!has_staged() && arrange_flush_) arrange_flush_();
}

void LedgerWriter::Flush() {
  std::vector<LedgerRecord> records;
  for (const Staged& staged : staged_) records.push_back(EncodeRecord(staged.fact));
  const Status status = ledger_->Append(records, notes_);
  if (!status.ok()) {
    if (problem_.empty()) LogError("cannot write the ledger: {}; trying again", status.error());
    problem_ = "cannot write to the session folder (is the disk full?): " + status.error();
    return;
  }
  if (!problem_.empty()) LogInfo("the ledger can be written again");
  problem_.clear();
  const std::vector<Staged> batch = std::exchange(staged_, {});
  notes_.clear();
  ChangeWhole([&] {
    for (const Staged& staged : batch) {
      for (const OnCommitted& observer : observers_) observer(staged.fact);
      if (staged.then) staged.then(staged.fact);
    }
  });
}

std::map<std::string, std::string> LedgerWriter::Notes(const std::string& kind) const {
  auto notes = ledger_->Notes(kind);
  if (!notes.ok()) throw std::runtime_error(notes.error());
  return *std::move(notes);
}

std::vector<LedgerRecord> LedgerWriter::Range(int64_t from_seq, int64_t to_seq) const {
  auto records = ledger_->Range(from_seq, to_seq);
  if (!records.ok()) throw std::runtime_error(records.error());
  return *std::move(records);
}

}  // namespace skein
