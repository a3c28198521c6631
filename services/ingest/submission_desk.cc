#include "ingest/submission_desk.h"

#include <utility>
#include <vector>

#include "core/attempt.h"
#include "core/log.h"
#include "event_loop/step_record.h"
#include "photo/photo_name.h"
#include "session/submap_facts.h"

namespace skein {
namespace {

// Authors repeat their facts every two seconds.
constexpr double kForgetAfterS = 15;
// Of blobs that are pulled, by what they may have. An author alone may have them of one model and
// of the facts beside it.
constexpr int64_t kMaxPulledBytes = int64_t{4} << 30;
constexpr int64_t kMaxPulledBytesOfAuthor = int64_t{3} << 29;
constexpr size_t kMaxPulled = 256;  // facts
constexpr int kSubmissionSlot = 0;  // the loop's
constexpr char kSubmissionStep[] = "submission";

}  // namespace

SubmissionDesk::SubmissionDesk(Node& node, LedgerWriter& writer, BlobStore store, Clock listened)
    : node_(node),
      writer_(writer),
      store_(std::move(store)),
      listened_(std::move(listened)),
      worker_(node.loop()) {}

void SubmissionDesk::OnSubmission(const Fact& fact) {
  const Status taken =
      AttemptStep(&node_.steps(), kSubmissionSlot, {0, kSubmissionStep}, [&] { Take(fact); });
  if (!taken.ok()) NoteThrown(fact, taken.error());
}

void SubmissionDesk::NoteThrown(const Fact& fact, const std::string& reason) {
  const fact_header_t& header = Header(fact);
  if (pulling_.count(KeyOf(fact)) > 0) Drop(KeyOf(fact), reason);
  if (thrown_.Note(header.fact_id)) return Refuse(header, submit_reply_t::REFUSED, reason);
  LogWarn("{} of {}: {}; its author repeats it", Printable(header.fact_id),
          Printable(header.author), reason);
}

void SubmissionDesk::Take(const Fact& fact) {
  const fact_header_t& header = Header(fact);
  if (const int64_t seq = writer_.history().FindFact(header.fact_id)) {
    // A staged fact is answered at its flush.
    if (seq <= writer_.durable_head()) Reply(header, submit_reply_t::COMMITTED, seq, "");
    return;
  }
  const auto pulling = pulling_.find(KeyOf(fact));
  if (pulling != pulling_.end()) {
    pulling->second.repeated_s = listened_();
    return Reply(header, submit_reply_t::PULLING, 0, "");
  }
  CommitOrRefuse(fact);
}

void SubmissionDesk::CommitOrRefuse(const Fact& fact) {
  const fact_header_t& header = Header(fact);
  if (const Status status = CheckLease(fact, writer_.state()); !status.ok()) {
    return Refuse(header, submit_reply_t::NOT_LEASED, status.error());
  }
  if (const Status status = CheckSubmission(fact, writer_.state()); !status.ok()) {
    return Refuse(header, submit_reply_t::REFUSED, status.error());
  }
  std::vector<NamedBlob> missing;
  for (const NamedBlob& blob : NamedBlobs(fact)) {
    if (!store_.Has(blob.blob_id)) missing.push_back(blob);
  }
  missing.empty() ? Commit(fact) : Pull(fact, missing);
}

void SubmissionDesk::Refuse(const fact_header_t& header, int8_t status, const std::string& reason) {
  LogWarn("refused {} of {}: {}", Printable(header.fact_id), Printable(header.author), reason);
  Reply(header, status, 0, reason);
}

bool SubmissionDesk::HasRoomFor(const std::string& author, int64_t max_bytes) const {
  int64_t all = max_bytes, of_author = max_bytes;
  for (const auto& [key, pulling] : pulling_) {
    all += pulling.max_bytes;
    if (key.second == author) of_author += pulling.max_bytes;
  }
  return pulling_.size() < kMaxPulled && all <= kMaxPulledBytes &&
         of_author <= kMaxPulledBytesOfAuthor;
}

void SubmissionDesk::Pull(const Fact& fact, const std::vector<NamedBlob>& missing) {
  const fact_header_t& header = Header(fact);
  Reply(header, submit_reply_t::PULLING, 0, "");
  int64_t max_bytes = 0;
  for (const NamedBlob& blob : missing) max_bytes += blob.max_bytes;
  if (!HasRoomFor(header.author, max_bytes)) return;
  const PullKey key = KeyOf(fact);
  Pulling& pulling = pulling_[key];
  pulling = {fact, {}, {}, listened_(), max_bytes};
  for (const NamedBlob& blob : missing) {
    const std::string& id = blob.blob_id;
    if (!pulling.missing.insert(id).second) continue;
    pulling.fetches[id] = node_.blobs().Fetch(
        id, header.author,
        [this, key, id](Result<Bytes> bytes) { OnBlob(key, id, std::move(bytes)); },
        {blob.max_bytes});
  }
}

void SubmissionDesk::OnBlob(const PullKey& key, const std::string& blob_id, Result<Bytes> bytes) {
  const auto found = pulling_.find(key);
  if (found == pulling_.end()) return;
  found->second.fetches.erase(blob_id);
  if (!bytes.ok()) return Drop(key, bytes.error());
  worker_.Run(
      [store = store_, content = *std::move(bytes)]() mutable {
        return Attempt([&] { return store.Put(content).status(); });
      },
      [this, key, blob_id](const Status& kept) { OnKept(key, blob_id, kept); });
}

void SubmissionDesk::OnKept(const PullKey& key, const std::string& blob_id, const Status& kept) {
  const auto found = pulling_.find(key);
  if (found == pulling_.end()) return;
  if (!kept.ok()) return Drop(key, kept.error());
  found->second.missing.erase(blob_id);
  if (!found->second.missing.empty()) return;
  const Fact fact = std::move(found->second.fact);
  pulling_.erase(found);
  // The session went on while the blobs came.
  if (writer_.history().FindFact(key.first) == 0) OnSubmission(fact);
}

// The author's next repeat starts again.
void SubmissionDesk::Drop(const PullKey& key, const std::string& reason) {
  const auto found = pulling_.find(key);
  LogWarn("blobs of {} did not come: {}", Printable(key.first), reason);
  const auto fetches = std::move(found->second.fetches);
  pulling_.erase(found);
  for (const auto& [blob, fetch] : fetches) node_.blobs().Cancel(fetch);
}

void SubmissionDesk::Commit(const Fact& fact) {
  const Fact staged = writer_.Stage(fact, {}, [this](const Fact& committed) {
    const fact_header_t& header = Header(committed);
    Reply(header, submit_reply_t::COMMITTED, header.seq, "");
  });
  const auto* merge = std::get_if<merge_t>(&staged);
  if (merge == nullptr || merge->state != merge_t::DONE) return;
  // In one commit with the merge, so that no crash leaves both submaps alive.
  submap_end_t end = MakeMergedEnd(*merge, writer_.state());
  end.header.author = node_.instance();
  if (writer_.history().FindFact(end.header.fact_id) == 0) writer_.Stage(end);
}

void SubmissionDesk::Tick() {
  const double now_s = listened_();
  std::vector<PullKey> forgotten;
  for (const auto& [key, pulling] : pulling_) {
    if (now_s - pulling.repeated_s > kForgetAfterS) forgotten.push_back(key);
  }
  for (const PullKey& key : forgotten) Drop(key, "its author is gone");
}

void SubmissionDesk::Reply(const fact_header_t& header, int8_t status, int64_t seq,
                           const std::string& reason) {
  submit_reply_t reply{};
  reply.author = header.author;
  reply.fact_id = header.fact_id;
  reply.status = status;
  reply.seq = seq;
  reply.reason = ClampText(reason);
  node_.Publish(kSubmitReplyChannel, reply);
}

}  // namespace skein
