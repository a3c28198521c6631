#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "blobs/blob_store.h"
#include "core/clock.h"
#include "event_loop/worker_thread.h"
#include "ingest/ledger_writer.h"
#include "ingest/submission_rules.h"
#include "ingest/thrown_counts.h"
#include "node/node.h"

namespace skein {

// Takes submitted facts: answers repeats, judges new ones (submission_rules.h), pulls missing blobs
// from the author, commits. A fact on which an exception comes is left to its author's repeats, and
// refused after the third. Pulls at a time are bounded, in all and of one author; other blobs are
// pulled when their author repeats the submission. Loop's thread only.
class SubmissionDesk {
 public:
  // By `listened` authors have stopped repeating.
  SubmissionDesk(Node& node, LedgerWriter& writer, BlobStore store, Clock listened);

  void OnSubmission(const Fact& fact);
  // Forgets pulls for authors that stopped repeating: at least once a minute.
  void Tick();

 private:
  // By fact_id and author. Each author's blobs are pulled on their own: the first whose blobs are
  // here commits, whatever becomes of the others.
  using PullKey = std::pair<std::string, std::string>;
  static PullKey KeyOf(const Fact& fact) { return {Header(fact).fact_id, Header(fact).author}; }

  // A submission whose blobs are on their way.
  struct Pulling {
    Fact fact;
    std::set<std::string> missing;
    std::map<std::string, BlobClient::FetchId> fetches;
    double repeated_s = 0;
    int64_t max_bytes = 0;  // that its blobs may have
  };

  void Take(const Fact& fact);
  void NoteThrown(const Fact& fact, const std::string& reason);
  bool HasRoomFor(const std::string& author, int64_t max_bytes) const;
  void Pull(const Fact& fact, const std::vector<NamedBlob>& missing);
  void OnBlob(const PullKey& key, const std::string& blob_id, Result<Bytes> bytes);
  void OnKept(const PullKey& key, const std::string& blob_id, const Status& kept);
  void Drop(const PullKey& key, const std::string& reason);
  void CommitOrRefuse(const Fact& fact);
  void Refuse(const fact_header_t& header, int8_t status, const std::string& reason);
  void Commit(const Fact& fact);
  void Reply(const fact_header_t& header, int8_t status, int64_t seq, const std::string& reason);

  Node& node_;
  LedgerWriter& writer_;
  const BlobStore store_;
  const Clock listened_;
  std::map<PullKey, Pulling> pulling_;
  ThrownCounts thrown_;  // by fact_id
  WorkerThread worker_;  // last: ends first
};

}  // namespace skein
