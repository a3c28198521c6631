#include "mapper/merge_executor.h"

#include <algorithm>
#include <set>
#include <stdexcept>

#include "core/clock.h"
#include "core/log.h"
#include "map/model_io.h"
#include "mapping/checkpoint.h"
#include "merging/absorb.h"
#include "session/merge_similarity.h"

namespace skein {
namespace {

// Until a refused step of a merge is submitted again.
constexpr double kRetryS = 2;

AbsorbOptions OptionsFor(const merge_t& order, bool was_done) {
  AbsorbOptions options;
  options.min_shared_images = std::min(options.min_shared_images, order.num_shared_images);
  AdaptToFewImages(order.num_shared_images, &options.sim3);
  // The ledger says that it is done: the source is gone, and its photos must not be lost.
  options.verify = !was_done;
  return options;
}

// What absorbing came to: why not, or "", the target as it was and what became of photos: those
// that are new in it or, if it failed, that it left to the source.
struct Absorption {
  std::string reason;
  std::shared_ptr<const colmap::Reconstruction> before;
  std::vector<PhotoEvent> events;
};

std::set<ImageId> RegisteredOnlyIn(const colmap::Reconstruction& model,
                                   const colmap::Reconstruction& other) {
  std::set<ImageId> ids;
  for (const ImageId id : model.RegImageIds()) {
    if (!other.ExistsImage(id) || !other.IsImageRegistered(id)) ids.insert(id);
  }
  return ids;
}

// Why the two sides of a merged model show different places, or "". Along matches that neither
// model was built from.
std::string WhyLookAlike(const Submap& submap, const colmap::Reconstruction& target,
                         const colmap::Reconstruction& source,
                         const colmap::Reconstruction& merged) {
  const LookAlikeOptions& options = submap.options().registration.look_alike;
  const CellVotes votes =
      CompareSides(options, submap.map(), merged, RegisteredOnlyIn(target, source),
                   RegisteredOnlyIn(source, target));
  if (!ShowsAnotherPlace(options, votes)) return "";
  return "look-alike places: " + std::to_string(votes.num_different) + " of " +
         std::to_string(votes.num_cells()) + " parts that both sides show are different";
}

// Two places that look alike: a photo is of one of them.
void LeaveStrangers(const colmap::Reconstruction& source, Submap* submap, Absorption* absorption) {
  submap->YieldLookAlikesTo(source,
                            [&](const PhotoEvent& event) { absorption->events.push_back(event); });
}

// Runs in the submap's thread. Returns why not, or "".
std::string AbsorbModel(const ModelArchive& archive, const merge_t& order, bool was_done,
                        Submap* submap, Absorption* absorption) {
  const Result<colmap::Reconstruction> source = DecodeModel(archive);
  if (!source.ok()) return "source: " + source.error();
  // The target's registered photos only.
  Result<colmap::Reconstruction> decoded = DecodeModel(EncodeModel(submap->map().reconstruction()));
  if (!decoded.ok()) return "target: " + decoded.error();
  const auto target = std::make_shared<const colmap::Reconstruction>(*std::move(decoded));
  absorption->before = target;
  const AbsorbOptions options = OptionsFor(order, was_done);
  // Both were adjusted since the order; the order's similarity stands where there is none now.
  const Sim3Result now = EstimateSim3(SharedPhotosOf(*source, *target), options.sim3);
  const std::optional<Similarity> similarity =
      now.success ? now.target_from_source : SimilarityOf(order);
  if (!similarity) return "the merge was ordered with a similarity that is none";
  const AbsorbResult result = Absorb(*target, *source, *similarity, options);
  if (result.looks_alike) LeaveStrangers(*source, submap, absorption);
  if (!result.ok) return result.reason.empty() ? "not verified" : result.reason;
  if (options.verify) {
    const std::string wrong = WhyLookAlike(*submap, *target, *source, result.merged);
    if (!wrong.empty()) {
      LeaveStrangers(*source, submap, absorption);
      return wrong;
    }
  }
  const Status status = submap->ReplaceModel(result.merged);
  if (!status.ok()) return status.error();
  for (const PhotoEvent& event : submap->RegisteredEvents()) {
    const bool is_new = !target->ExistsImage(static_cast<ImageId>(event.image_id));
    if (is_new) absorption->events.push_back(event);
  }
  return "";
}

}  // namespace

void MergeExecutor::OnOrdered(const merge_t& ordered, SubmapRun& run,
                              std::function<void()> resume) {
  open_ = Open();
  open_.ordered = ordered;
  open_.resume = std::move(resume);
  open_.start_s = MonotonicS();
  const std::vector<merge_t>& facts = index_.FindMerge(ordered.merge_id);
  open_.replay = !facts.empty() && facts.back().state == merge_t::DONE;
  if (ordered.source_id == run.submap_id()) return Freeze(run);
  for (const merge_t& fact : facts) {
    if (fact.state == merge_t::FROZEN) return Absorb(fact, run);
  }
}

void MergeExecutor::OnMergeFact(const merge_t& merge, SubmapRun& run) {
  if (!IsOpen(merge.merge_id)) return;
  const bool is_target = merge.target_id == run.submap_id();
  if (merge.state == merge_t::FROZEN && is_target) Absorb(merge, run);
  if (merge.state == merge_t::UNDONE) Resume();
}

void MergeExecutor::Resume() {
  const std::function<void()> resume = std::move(open_.resume);
  open_ = Open();
  resume();
}

void MergeExecutor::Later(const SubmapRun& run, std::function<void()> then) {
  const std::weak_ptr<bool> alive = run.alive();
  node_.loop().AddOneShot(kRetryS,
                          [this, alive, merge_id = open_.ordered.merge_id, then = std::move(then)] {
                            if (!alive.expired() && IsOpen(merge_id)) then();
                          });
}

void MergeExecutor::Freeze(SubmapRun& run) {
  auto blob = std::make_shared<std::string>();
  run.RunOnSubmap(
      [blob, &blobs = node_.blobs()](Submap& submap) {
        *blob = blobs.Offer(EncodeModelArchive(SaveSubmap(&submap)));
      },
      [this, blob, merge_id = open_.ordered.merge_id, &run] {
        if (!IsOpen(merge_id)) return;
        merge_t fact = MakeFact(merge_t::FROZEN, run);
        fact.model_blob = *blob;
        // Where the target has ended the merge by an earlier FROZEN, its word is in the ledger, and
        // on its way here.
        run.Submit(
            fact, [](int64_t) {},
            [this, merge_id, &run](const std::string&) {
              if (IsOpen(merge_id)) Later(run, [this, &run] { Freeze(run); });
            });
      });
}

void MergeExecutor::Absorb(const merge_t& frozen, SubmapRun& run) {
  if (open_.absorbing) return;
  open_.absorbing = true;
  const std::weak_ptr<bool> alive = run.alive();
  node_.blobs().Fetch(frozen.model_blob, "ingest", [this, alive, &run](Result<Bytes> bytes) {
    if (!alive.expired()) OnSourceModel(std::move(bytes), run);
  });
}

void MergeExecutor::OnSourceModel(Result<Bytes> bytes, SubmapRun& run) {
  Result<ModelArchive> decoded =
      bytes.ok() ? DecodeModelArchive(*bytes) : Result<ModelArchive>(bytes.status());
  if (!decoded.ok()) return OnAbsorbed("source: " + decoded.error(), run);
  auto archive = std::make_shared<const ModelArchive>(std::move(*decoded));
  const Result<std::vector<int64_t>> photos = PhotosOfArchive(*archive);
  if (!photos.ok()) return OnAbsorbed("source: " + photos.error(), run);
  run.AddPhotos(*photos, [this, archive, &run](const Status& status) {
    if (!status.ok()) return OnAbsorbed(status.error(), run);
    auto result = std::make_shared<Absorption>();
    run.RunOnSubmap(
        [archive, result, order = open_.ordered, was_done = open_.replay](Submap& submap) {
          result->reason = AbsorbModel(*archive, order, was_done, &submap, result.get());
        },
        [this, result, &run] {
          open_.before = result->before;
          open_.absorbed = std::move(result->events);
          OnAbsorbed(result->reason, run);
        });
  });
}

// DONE only once everyone can know where the source's photos are now.
void MergeExecutor::OnAbsorbed(const std::string& reason, SubmapRun& run) {
  LogInfo("submap {} absorbs {}: {}", open_.ordered.target_id, open_.ordered.source_id,
          reason.empty() ? "done" : reason);
  if (!reason.empty()) {
    run.Report(open_.absorbed);
    return Conclude(merge_t::UNDONE, reason, run);
  }
  run.TakeOver(open_.absorbed);
  run.WhenCommitted([this, &run] { Conclude(merge_t::DONE, "", run); });
}

// The run rests until the end is in the ledger: a checkpoint that holds the merged model before
// that would have its successor start behind an order that nobody carries out.
void MergeExecutor::Conclude(int8_t state, const std::string& reason, SubmapRun& run) {
  if (open_.replay) return Resume();
  merge_t fact = MakeFact(state, run);
  fact.reason = ClampText(reason);
  fact.duration_s = static_cast<float>(MonotonicS() - open_.start_s);
  run.Submit(
      fact,
      [this, merge_id = fact.merge_id](int64_t) {
        if (IsOpen(merge_id)) Resume();
      },
      [this, state, merge_id = fact.merge_id, &run](const std::string& refusal) {
        if (IsOpen(merge_id)) OnEndRefused(state, refusal, run);
      });
}

// The ledger holds that the source lives on: so the target becomes what it was, and says so.
void MergeExecutor::OnEndRefused(int8_t state, const std::string& reason, SubmapRun& run) {
  if (state == merge_t::UNDONE) {
    return Later(run, [this, reason, &run] { Conclude(merge_t::UNDONE, reason, run); });
  }
  run.RunOnSubmap(
      [before = open_.before](Submap& submap) {
        const Status status = submap.ReplaceModel(*before);
        if (!status.ok()) throw std::logic_error("the submap's own model: " + status.error());
      },
      [this, reason, &run] {
        for (PhotoEvent& event : open_.absorbed) {
          event.state = PhotoEvent::State::kWithdrawn;
          event.reason = "its submap's merge was refused: " + reason;
        }
        run.Report(open_.absorbed);
        Conclude(merge_t::UNDONE, "refused by the ledger: " + reason, run);
      });
}

merge_t MergeExecutor::MakeFact(int8_t state, const SubmapRun& run) const {
  merge_t fact = open_.ordered;
  fact.header = {};
  fact.state = state;
  fact.reason.clear();
  fact.ledger_seq = open_.ordered.header.seq;
  if (run.submap_id() == fact.source_id) fact.source_epoch = run.epoch();
  if (run.submap_id() == fact.target_id) fact.target_epoch = run.epoch();
  fact.header.fact_id = "merge/" + std::to_string(fact.merge_id) + "/" +
                        (state == merge_t::FROZEN ? "frozen" : "end") + "/" +
                        std::to_string(run.epoch());
  return fact;
}

}  // namespace skein
