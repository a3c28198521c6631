#include "merging/submap_merge.h"

#include <algorithm>

#include "core/clock.h"
#include "core/log.h"
#include "disambiguation/similar_structures.h"
#include "merging/fuse.h"
#include "sfm/model_io.h"

namespace skein {
namespace {

// Through so many photos two submaps are compared. Where fewer are in both, the target takes in
// guests of the source.
constexpr int kComparedPhotos = 12;

AbsorbOptions OptionsFor(const MergeOrder& order, const Submap& submap) {
  AbsorbOptions options;
  options.sim3 = order.sim3;
  options.min_shared_images = order.min_shared_images;
  options.intrinsics.fixed = submap.map().FixedCameras();
  // The ledger says that it is done: the source is gone, and its photos must not be lost.
  options.verify = !order.was_done;
  return options;
}

// The order's similarity as it is now, both submaps having been adjusted since. If all photos agree
// with it, no other similarity has more.
std::optional<Similarity> RefineOrdered(const MergeOrder& order,
                                        const std::vector<SharedPhoto>& shared) {
  if (!order.target_from_source || !order.keeps_frames) return std::nullopt;
  const Sim3Result now = RefineSim3From(*order.target_from_source, shared, order.sim3);
  const int num_agreeing = static_cast<int>(now.inlier_image_ids.size());
  const bool holds = num_agreeing >= std::min(order.num_agreeing, now.num_usable_images);
  if (!now.success || !holds) return std::nullopt;
  return now.target_from_source;
}

std::optional<Similarity> FindSimilarity(const MergeOrder& order,
                                         const std::vector<SharedPhoto>& shared) {
  if (const auto refined = RefineOrdered(order, shared)) return refined;
  const Sim3Result anew = EstimateSim3(shared, order.sim3);
  if (anew.success) return anew.target_from_source;
  if (order.target_from_source) return order.target_from_source;
  if (order.was_done) return anew.target_from_source;  // it must succeed, with whatever was found
  return std::nullopt;
}

int CountShared(const Reconstruction& source, const SceneMap& target) {
  const std::vector<ImageId>& ids = source.RegImageIds();
  return static_cast<int>(
      std::count_if(ids.begin(), ids.end(), [&](ImageId id) { return target.IsRegistered(id); }));
}

// An error if the photos of the two models show different places. Few of the matches between them
// took part in either model.
Status CheckOnePlace(const Submap& submap, const Reconstruction& source,
                     const Reconstruction& merged) {
  const SceneMap& map = submap.map();
  const DividedPhotos divided =
      DividePhotos(map, RegisteredIn(map.reconstruction()), RegisteredIn(source), merged);
  const PlacesOfTwoSets places = ComparePlaces(map, merged, divided.of_first, divided.of_second);
  if (!places.differ) return Status::Ok();
  return FailedPrecondition("visually similar places: " + places.reason);
}

AbsorbResult Compare(const Reconstruction& source, const MergeOrder& order, const Submap& submap) {
  const Reconstruction& target = submap.map().reconstruction();
  const std::optional<Similarity> similarity =
      FindSimilarity(order, SharedPhotosOf(source, target));
  AbsorbResult result;
  if (!similarity) {
    result.status = DataLoss("the merge was ordered with a similarity that is none");
    return result;
  }
  result = Absorb(target, source, *similarity, OptionsFor(order, submap));
  if (!result.status.ok()) return result;
  if (!order.was_done) result.status = CheckOnePlace(submap, source, result.merged);
  result.shows_another_place = !result.status.ok();
  return result;
}

// The target with photos of the source as guests, and the source. The guests stay only in a merged
// model.
AbsorbResult CompareWithGuests(const Reconstruction& source, const MergeOrder& order,
                               Submap* submap) {
  const int num_guests = std::max(0, kComparedPhotos - CountShared(source, submap->map()));
  Timer timer;
  const auto guests = submap->PlaceGuests(submap->FindGuests(source, num_guests));
  const double guests_s = timer.ElapsedS();
  timer.Restart();
  AbsorbResult comparison = Compare(source, order, *submap);
  LogInfo("{} guests in {:.2f} s, compared and merged in {:.2f} s", guests->size(), guests_s,
          timer.ElapsedS());
  return comparison;
}

// The merged model takes the target's place.
void TakeMerged(const AbsorbResult& comparison, Submap* submap, Absorption* absorption) {
  const auto before =
      std::make_shared<const Reconstruction>(CopyRegistered(submap->map().reconstruction()));
  absorption->status = submap->ReplaceModel(comparison.merged);
  if (!absorption->status.ok()) return;
  absorption->before = before;
  submap->TellNewAndGone(
      before->RegImageIds(),  // ascending in a copy
      {Refusal::Cause::kCamera, "its camera's intrinsics went astray; they are estimated anew"},
      [&](const PhotoEvent& event) { absorption->events.push_back(event); });
  for (const ImageId id : comparison.left_out) submap->Enqueue(id);
}

}  // namespace

Absorption AbsorbIntoSubmap(const Reconstruction& source, const MergeOrder& order, Submap* submap) {
  Absorption absorption;
  const AbsorbResult comparison = CompareWithGuests(source, order, submap);
  absorption.status = comparison.status;
  absorption.shows_another_place = comparison.shows_another_place;
  if (absorption.status.ok()) {
    TakeMerged(comparison, submap, &absorption);
  } else if (comparison.shows_another_place) {  // a photo shows one of the two
    submap->YieldPhotosTo(source,
                          [&](const PhotoEvent& event) { absorption.events.push_back(event); });
  }
  return absorption;
}

Absorption AbsorbBatch(const Submap& source, Submap* submap) {
  Absorption absorption = AbsorbIntoSubmap(source.map().reconstruction(), MergeOrder(), submap);
  LogInfo("batch: {}", absorption.status.ok() ? "absorbed" : absorption.status.error());
  return absorption;
}

}  // namespace skein
