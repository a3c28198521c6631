#include "mapper/merge_executor.h"

#include <stdexcept>
#include <utility>

#include "core/clock.h"
#include "core/log.h"
#include "ledger/fact_ids.h"
#include "mapper/messages.h"
#include "mapper/submap_run.h"
#include "mapping/checkpoint.h"
#include "merging/fuse.h"
#include "session/submap_steps.h"
#include "sfm/model_io.h"

namespace skein {
namespace {

// Until a refused step of a merge is submitted again.
constexpr double kRetryS = 2;
constexpr char kCutReason[] = "the time of the finish was up";

Status AddPhotosOf(const LoadedModel& source, Submap* submap) {
  const Timer timer;
  const Status added = AddToSubmap(source.photos, submap);
  LogInfo("{} of its photos added in {:.2f} s", source.photos->size(), timer.ElapsedS());
  return added;
}

// Worker's thread. Uses up the source's archive.
Absorption AbsorbSource(const LoadedModel& source, const MergeOrder& order, Submap* submap) {
  Absorption absorption;
  absorption.status = AddPhotosOf(source, submap);
  if (!absorption.status.ok()) return absorption;
  if (submap->options().IsStopped() && !order.was_done) {
    absorption.status = FailedPrecondition(kCutReason);
    return absorption;
  }
  const Result<Reconstruction> model = DecodeModel(std::move(*source.archive));
  if (model.ok()) return AbsorbIntoSubmap(*model, order, submap);
  absorption.status = model.status().Within("source");
  return absorption;
}

}  // namespace

void MergeExecutor::OnOrdered(const merge_t& ordered) {
  const MergeState& merge = *session_.FindMerge(ordered.merge_id);
  open_ = Open();
  open_->ordered = ordered;
  open_->start_s = node_.loop().now_s();
  open_->replay = merge.latest().state == merge_t::DONE;
  if (ordered.source_id == run_.submap_id()) return Freeze();
  if (run_.IsLeftOut(Step())) return LeaveOut();
  for (const merge_t& fact : merge.facts) {
    if (fact.state == merge_t::FROZEN) return Absorb(fact);
  }
  if (session_.finish().is_cut()) GiveUp();
}

std::string MergeExecutor::Step() const { return MergeStep(open_->ordered.merge_id); }

// It was tried three times. One that the ledger holds for done cannot be undone: without it this
// submap would claim photos that it does not have.
void MergeExecutor::LeaveOut() {
  open_->absorbing = true;
  const std::string reason = "it failed three times: " + run_.WhyLeftOut(Step());
  open_->replay ? run_.Dissolve("merge, carried out again: " + reason) : Fail(reason);
}

void MergeExecutor::GiveUp() {
  if (!open_ || open_->absorbing || open_->ordered.target_id != run_.submap_id()) return;
  open_->absorbing = true;  // whatever the source submits yet is not absorbed
  Fail(kCutReason);
}

void MergeExecutor::OnMergeFact(const merge_t& merge) {
  if (!IsOpen(merge.merge_id)) return;
  const bool is_target = merge.target_id == run_.submap_id();
  if (merge.state == merge_t::FROZEN && is_target) Absorb(merge);
  if (merge.state == merge_t::UNDONE) Close();
}

// What is being absorbed is taken back when it is there: the ledger refuses its end.
void MergeExecutor::OnSubmapEnd() {
  if (open_ && !open_->absorbing && IsAbandoned()) Close();
}

void MergeExecutor::Close() {
  open_.reset();
  run_.OnMergeOver();
}

void MergeExecutor::Later(std::function<void()> then) {
  node_.loop().AddOneShot(kRetryS, WhileOpen(std::move(then)));
}

void MergeExecutor::Freeze() {
  run_.RunOnWorker(
      ModelStep(),
      [&blobs = node_.blobs()](Submap& submap) {
        return blobs.Offer(EncodeModelArchive(SaveSubmap(&submap)));
      },
      WhileOpen([this](const std::string& blob) { SubmitFrozen(blob); }));
}

void MergeExecutor::SubmitFrozen(const std::string& model_blob) {
  merge_t fact = MakeFact(merge_t::FROZEN);
  fact.model_blob = model_blob;
  // Where the target has ended the merge by an earlier FROZEN, its word is in the ledger, and on
  // its way here.
  run_.Submit(
      fact, [](int64_t) {}, WhileOpen([this](const std::string&) { Later([this] { Freeze(); }); }));
}

void MergeExecutor::Absorb(const merge_t& frozen) {
  if (open_->absorbing) return;
  open_->absorbing = true;
  open_->source_epoch = frozen.source_epoch;
  run_.LoadModel(Step(), frozen.model_blob, WhileOpen([this](const Result<LoadedModel>& source) {
                   source.ok() ? OnSource(*source) : Fail("source: " + source.error());
                 }));
}

void MergeExecutor::OnSource(const LoadedModel& source) {
  LogInfo("the source is here {:.2f} s after the order", node_.loop().now_s() - open_->start_s);
  run_.RunOnWorker(
      Step(),
      [source, order = Order()](Submap& submap) { return AbsorbSource(source, order, &submap); },
      WhileOpen([this](Absorption absorption) {
        open_->absorption = std::move(absorption);
        OnAbsorbed();
      }));
}

// A submap keeps its frame within an epoch.
MergeOrder MergeExecutor::Order() const {
  const merge_t& ordered = open_->ordered;
  MergeOrder order = MergeOrderOf(ordered);
  order.keeps_frames =
      ordered.source_epoch == open_->source_epoch && ordered.target_epoch == run_.epoch();
  order.was_done = open_->replay;
  return order;
}

// DONE only once everyone can know where the source's photos are now.
void MergeExecutor::OnAbsorbed() {
  const Absorption& absorption = open_->absorption;
  if (!absorption.status.ok()) {
    run_.Report(absorption.events);
    return Fail(absorption.status.error());
  }
  LogInfo("submap {} has absorbed {}, {:.1f} s after it was ordered", open_->ordered.target_id,
          open_->ordered.source_id, node_.loop().now_s() - open_->start_s);
  run_.OnAbsorbed(absorption.events);
  run_.WhenDecided(WhileOpen([this] { Conclude(merge_t::DONE, ""); }));
}

void MergeExecutor::Fail(const std::string& reason) {
  LogInfo("submap {} does not absorb {}: {}", open_->ordered.target_id, open_->ordered.source_id,
          reason);
  Conclude(merge_t::UNDONE, reason);
}

// The run rests until the end is in the ledger. No checkpoint may hold the merged model before: a
// successor would start from it, behind the order, and nobody would carry the order out.
void MergeExecutor::Conclude(int8_t state, const std::string& reason) {
  if (open_->replay || (state == merge_t::UNDONE && IsAbandoned())) return Close();
  merge_t fact = MakeFact(state);
  fact.reason = ClampText(reason);
  fact.similar_places = state == merge_t::UNDONE && open_->absorption.shows_another_place;
  fact.duration_s = static_cast<float>(node_.loop().now_s() - open_->start_s);
  run_.Submit(
      fact, WhileOpen([this](int64_t) { Close(); }),
      WhileOpen([this, state](const std::string& refusal) { OnEndRefused(state, refusal); }));
}

void MergeExecutor::OnEndRefused(int8_t state, const std::string& reason) {
  if (state == merge_t::DONE) return GoBack(reason);
  Later([this, reason] { Conclude(merge_t::UNDONE, reason); });
}

// The ledger holds that the source lives on: so the target becomes what it was, and says so.
void MergeExecutor::GoBack(const std::string& reason) {
  const auto on_back = [this, reason](const std::vector<PhotoEvent>& events) {
    run_.Report(events);
    Conclude(merge_t::UNDONE, "refused by the ledger: " + reason);
  };
  run_.RunOnWorker(
      Step(),
      [before = open_->absorption.before, reason](Submap& submap) {
        const std::set<ImageId> merged = RegisteredIn(submap.map().reconstruction());
        const Status status = submap.ReplaceModel(*before);
        if (!status.ok()) throw std::logic_error("the submap's own model: " + status.error());
        std::vector<PhotoEvent> events;
        submap.TellNewAndGone({merged.begin(), merged.end()},
                              {Refusal::Cause::kOther, "its map's merge was refused: " + reason},
                              [&events](const PhotoEvent& event) { events.push_back(event); });
        return events;
      },
      WhileOpen(on_back));
}

merge_t MergeExecutor::MakeFact(int8_t state) const {
  merge_t fact = open_->ordered;
  fact.header = {};
  fact.state = state;
  fact.reason.clear();
  fact.ledger_seq = run_.worked_seq();
  if (run_.submap_id() == fact.source_id) fact.source_epoch = run_.epoch();
  if (run_.submap_id() == fact.target_id) fact.target_epoch = run_.epoch();
  fact.header.fact_id = state == merge_t::FROZEN ? MergeFrozenFactId(fact.merge_id, run_.epoch())
                                                 : MergeEndFactId(fact.merge_id, run_.epoch());
  return fact;
}

}  // namespace skein
