#include "mapper/absorb_source.h"

#include <algorithm>
#include <optional>
#include <set>

#include "map/model_io.h"
#include "merging/absorb.h"
#include "session/merge_similarity.h"

namespace skein {
namespace {

AbsorbOptions OptionsFor(const merge_t& order, bool was_done) {
  AbsorbOptions options;
  options.min_shared_images = std::min(options.min_shared_images, order.num_shared_images);
  AdaptToFewImages(order.num_shared_images, &options.sim3);
  // The ledger says that it is done: the source is gone, and its photos must not be lost.
  options.verify = !was_done;
  return options;
}

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
void YieldPhotos(const colmap::Reconstruction& source, Submap* submap, Absorption* absorption) {
  submap->YieldLookAlikesTo(source,
                            [&](const PhotoEvent& event) { absorption->events.push_back(event); });
}

// Returns why not, or "".
std::string AbsorbModel(const ModelArchive& archive, const merge_t& order, bool was_done,
                        Submap* submap, Absorption* absorption) {
  const Result<colmap::Reconstruction> source = DecodeModel(archive);
  if (!source.ok()) return "source: " + source.error();
  // The target's registered photos only.
  Result<colmap::Reconstruction> decoded = DecodeModel(EncodeModel(submap->map().reconstruction()));
  if (!decoded.ok()) return "target: " + decoded.error();
  const auto target = std::make_shared<const colmap::Reconstruction>(*std::move(decoded));
  absorption->before = target;
  AbsorbOptions options = OptionsFor(order, was_done);
  options.intrinsics.fixed = submap->map().FixedCameras();
  // Both were adjusted since the order; the order's similarity stands where there is none now.
  const Sim3Result now = EstimateSim3(SharedPhotosOf(*source, *target), options.sim3);
  const std::optional<Similarity> similarity =
      now.success ? now.target_from_source : SimilarityOf(order);
  if (!similarity) return "the merge was ordered with a similarity that is none";
  const AbsorbResult result = Absorb(*target, *source, *similarity, options);
  if (result.looks_alike) YieldPhotos(*source, submap, absorption);
  if (!result.ok) return result.reason.empty() ? "not verified" : result.reason;
  if (options.verify) {
    const std::string wrong = WhyLookAlike(*submap, *target, *source, result.merged);
    if (!wrong.empty()) {
      YieldPhotos(*source, submap, absorption);
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

Absorption AbsorbSource(const ModelArchive& source, const merge_t& order, bool was_done,
                        Submap* submap) {
  Absorption absorption;
  absorption.reason = AbsorbModel(source, order, was_done, submap, &absorption);
  return absorption;
}

}  // namespace skein
