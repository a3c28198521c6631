#include "mapper/absorb_source.h"

#include <algorithm>
#include <optional>
#include <set>
#include <vector>

#include "core/clock.h"
#include "core/log.h"
#include "disambiguation/divided_photos.h"
#include "map/image_pose.h"
#include "merging/absorb.h"
#include "session/merge_similarity.h"
#include "sfm/model_io.h"

namespace skein {
namespace {

// Through so many photos two submaps are compared. Where fewer are in both, the target takes in
// guests of the source.
constexpr int kComparedPhotos = 12;

AbsorbOptions OptionsFor(const MergeTask& task) {
  AbsorbOptions options;
  const Sim3Options ordered = Sim3OptionsOf(task.order);
  if (ordered.Check().ok()) options.sim3 = ordered;
  options.min_shared_images = std::min(options.min_shared_images, task.order.num_shared_images);
  // The ledger says that it is done: the source is gone, and its photos must not be lost.
  options.verify = !task.was_done;
  return options;
}

// The order's similarity as it is now, both submaps having been adjusted since. It fits as long as
// no fewer photos agree with it than did then.
std::optional<Similarity> GoOnFromOrder(const MergeTask& task,
                                        const std::vector<SharedPhoto>& shared,
                                        const Sim3Options& options) {
  const std::optional<Similarity> ordered = SimilarityOf(task.order);
  if (!ordered || !task.same_epochs) return std::nullopt;
  const Sim3Result now = RefineSim3From(*ordered, shared, options);
  const int num_agreeing = static_cast<int>(now.inlier_image_ids.size());
  if (!now.success || num_agreeing < task.order.num_inlier_images) return std::nullopt;
  return now.target_from_source;
}

std::optional<Similarity> FindSimilarity(const MergeTask& task,
                                         const std::vector<SharedPhoto>& shared,
                                         const Sim3Options& options) {
  if (const auto similarity = GoOnFromOrder(task, shared, options)) return similarity;
  const Sim3Result anew = EstimateSim3(shared, options);
  if (anew.success) return anew.target_from_source;
  if (const auto ordered = SimilarityOf(task.order)) return ordered;
  if (task.was_done) return anew.target_from_source;  // it must succeed, with whatever was found
  return std::nullopt;
}

std::set<ImageId> RegisteredOnlyIn(const Reconstruction& model, const Reconstruction& other) {
  std::set<ImageId> ids;
  for (const ImageId id : model.RegImageIds()) {
    if (!IsRegisteredIn(other, id)) ids.insert(id);
  }
  return ids;
}

std::set<ImageId> PhotosOf(const Reconstruction& model) {
  return {model.RegImageIds().begin(), model.RegImageIds().end()};
}

// An error if the photos of the two models show different places. Few of the matches between them
// took part in either model.
Status CheckBothModels(const Submap& submap, const Reconstruction& target,
                       const Reconstruction& source, const Reconstruction& merged) {
  const DividedPhotos divided =
      DividePhotos(submap.map(), PhotosOf(target), PhotosOf(source), merged);
  const PlacesOfTwoSets places = ComparePlaces(submap.map(), merged, divided.of_first,
                                               divided.of_second, submap.options().min_cells);
  if (!places.differ) return Status::Ok();
  return FailedPrecondition("visually similar places: " + places.reason);
}

// What became of comparing the two.
struct Comparison {
  Status status;                     // why they stay apart
  bool shows_another_place = false;  // visually similar places are why
  Reconstruction merged;             // only if status is ok
  std::set<ImageId> left_out;        // of it: they are to be tried again
};

// Of two visually similar places a photo shows one.
void YieldPhotos(const Reconstruction& source, Submap* submap, Absorption* absorption) {
  submap->YieldPhotosTo(source,
                        [&](const PhotoEvent& event) { absorption->events.push_back(event); });
}

Comparison Compare(const Reconstruction& target, const Reconstruction& source,
                   const MergeTask& task, const Submap& submap) {
  Comparison comparison;
  AbsorbOptions options = OptionsFor(task);
  options.intrinsics.fixed = submap.map().FixedCameras();
  options.min_cells = submap.options().min_cells;
  const std::optional<Similarity> similarity =
      FindSimilarity(task, SharedPhotosOf(source, target), options.sim3);
  if (!similarity) {
    comparison.status = DataLoss("the merge was ordered with a similarity that is none");
    return comparison;
  }
  AbsorbResult result = Absorb(target, source, *similarity, options);
  comparison.status = result.status;
  comparison.shows_another_place = result.shows_another_place;
  if (!result.status.ok()) return comparison;
  if (options.verify) comparison.status = CheckBothModels(submap, target, source, result.merged);
  comparison.shows_another_place = !comparison.status.ok();
  comparison.merged = std::move(result.merged);
  comparison.left_out = std::move(result.left_out);
  return comparison;
}

// The target with photos of the source as guests, and the source. The guests stay only in a merged
// model.
Comparison CompareWithGuests(const Reconstruction& source, const MergeTask& task,
                             const Reconstruction& target, Submap* submap) {
  const size_t num_shared = source.NumRegImages() - RegisteredOnlyIn(source, target).size();
  const int num_guests = std::max(0, kComparedPhotos - static_cast<int>(num_shared));
  Timer timer;
  const auto guests = submap->PlaceGuests(submap->FindGuests(source, num_guests));
  const double guests_s = timer.ElapsedS();
  timer.Restart();
  const Comparison comparison =
      Compare(CopyRegistered(submap->map().reconstruction()), source, task, *submap);
  LogInfo("{} guests in {:.2f} s, compared and merged in {:.2f} s", guests->size(), guests_s,
          timer.ElapsedS());
  return comparison;
}

Status AbsorbModel(const Reconstruction& source, const MergeTask& task, Submap* submap,
                   Absorption* absorption) {
  const auto target =
      std::make_shared<const Reconstruction>(CopyRegistered(submap->map().reconstruction()));
  absorption->before = target;
  const Comparison comparison = CompareWithGuests(source, task, *target, submap);
  absorption->shows_another_place = comparison.shows_another_place;
  if (comparison.shows_another_place) YieldPhotos(source, submap, absorption);
  if (!comparison.status.ok()) return comparison.status;
  const Status status = submap->ReplaceModel(comparison.merged);
  if (!status.ok()) return status;
  const std::set<ImageId> before = RegisteredIn(*target);
  submap->TellNewAndGone(
      {before.begin(), before.end()},
      {Refusal::Cause::kCamera, "its camera's intrinsics went astray; they are estimated anew"},
      [&](const PhotoEvent& event) { absorption->events.push_back(event); });
  for (const ImageId id : comparison.left_out) submap->Enqueue(id);
  return Status::Ok();
}

}  // namespace

Absorption AbsorbSource(const ModelArchive& source, const MergeTask& task, Submap* submap) {
  Absorption absorption;
  const Result<Reconstruction> model = DecodeModel(source);
  absorption.status =
      model.ok() ? AbsorbModel(*model, task, submap, &absorption) : model.status().Within("source");
  return absorption;
}

Absorption AbsorbBatch(const Submap& source, Submap* submap) {
  MergeTask task{};
  task.order.num_shared_images = AbsorbOptions().min_shared_images;
  Absorption absorption;
  absorption.status =
      AbsorbModel(CopyRegistered(source.map().reconstruction()), task, submap, &absorption);
  LogInfo("batch: {}", absorption.status.ok() ? "absorbed" : absorption.status.error());
  return absorption;
}

}  // namespace skein
