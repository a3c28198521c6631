#include "merging/absorb.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "core/limits.h"
#include "core/option_check.h"
#include "map/filters.h"
#include "map/image_pose.h"
#include "map/scene_map.h"
#include "sfm/model_io.h"

namespace skein {
namespace {

// Of the points that both models see in one photo, those that fit together.
constexpr double kMinFusedShare = 0.3;

// A model's observations in those of its photos that the merge adjusts and whose pose stayed.
std::vector<Observation> ModelObservations(const Reconstruction& model,
                                           const std::set<ImageId>& seam,
                                           const std::set<ImageId>& left_out) {
  std::set<ImageId> images;
  for (const ImageId id : model.RegImageIds()) {
    if (seam.count(id) > 0 && left_out.count(id) == 0) images.insert(id);
  }
  return images.empty() ? std::vector<Observation>() : ObservationsOf(model, images);
}

// How many of the shared photos still fit both models' points after the adjustment.
int CountAgreeing(const Reconstruction& target, const Reconstruction& source,
                  const AbsorbResult& result) {
  int num_agreeing = 0;
  for (const ImageId id : result.fused.agreeing) {
    bool fits = true;
    for (const Reconstruction* model : {&target, &source}) {
      const std::vector<Observation> observations = ObservationsOf(*model, {id});
      const Residuals after =
          MeasureResiduals(result.merged, observations, 2 * limits::kMaxErrorPx);
      fits = fits && after.num_observations > 0 && after.GoodShare() >= 0.5;
    }
    num_agreeing += fits;
  }
  return num_agreeing;
}

Status CheckFused(const FuseResult& fused, const AbsorbOptions& options) {
  if (static_cast<int>(fused.agreeing.size()) < options.min_shared_images) {
    return FailedPrecondition("the poses of only " + std::to_string(fused.agreeing.size()) +
                              " shared images agree");
  }
  if (fused.num_fused_points < kMinFusedShare * fused.num_common_points) {
    return FailedPrecondition("only " + std::to_string(fused.num_fused_points) + " of " +
                              std::to_string(fused.num_common_points) +
                              " common points fit together");
  }
  return Status::Ok();
}

// Of registered photos.
std::set<CameraId> ImpossibleCameras(const Reconstruction& model) {
  std::set<CameraId> cameras;
  for (const ImageId id : model.RegImageIds()) {
    const CameraId camera = model.Image(id).CameraId();
    if (!HasPossibleIntrinsics(model.Camera(camera))) cameras.insert(camera);
  }
  return cameras;
}

// A model without the photos whose camera went astray in it.
class PossiblePart {
 public:
  explicit PossiblePart(const Reconstruction& model) : model_(model) {
    const std::set<CameraId> impossible = ImpossibleCameras(model);
    if (impossible.empty()) return;
    part_ = CopyRegistered(model);
    for (const ImageId id : model.RegImageIds()) {
      if (impossible.count(model.Image(id).CameraId()) == 0) continue;
      part_->DeRegisterImage(id);
      left_out_.push_back(id);
    }
  }
  const Reconstruction& model() const { return part_ ? *part_ : model_; }
  const std::vector<ImageId>& left_out() const { return left_out_; }

 private:
  const Reconstruction& model_;
  std::optional<Reconstruction> part_;
  std::vector<ImageId> left_out_;
};

Status CheckBothModels(const Reconstruction& target, const Reconstruction& source,
                       AbsorbResult* result) {
  const auto of_target = ModelObservations(target, result->seam, result->fused.kept_source);
  const auto of_source = ModelObservations(source, result->seam, result->fused.kept_target);
  result->target_before = MeasureResiduals(target, of_target, limits::kMaxErrorPx);
  result->target_after = MeasureResiduals(result->merged, of_target, limits::kMaxErrorPx);
  result->source_before = MeasureResiduals(source, of_source, limits::kMaxErrorPx);
  result->source_after = MeasureResiduals(result->merged, of_source, limits::kMaxErrorPx);
  return FirstError(
      {CompareResiduals(result->target_before, result->target_after).Within("target"),
       CompareResiduals(result->source_before, result->source_after).Within("source")});
}

Status Verify(const Reconstruction& target, const Reconstruction& source,
              const AbsorbOptions& options, AbsorbResult* result) {
  const Status status = CheckBothModels(target, source, result);
  if (!status.ok()) return status;
  const int num_agreeing = CountAgreeing(target, source, *result);
  if (num_agreeing < options.min_shared_images) {
    return FailedPrecondition("after the adjustment only " + std::to_string(num_agreeing) +
                              " shared images fit both models");
  }
  return Status::Ok();
}

AbsorbResult AbsorbPossiblePart(const Reconstruction& target, const Reconstruction& source,
                                const Similarity& target_from_source,
                                const AbsorbOptions& options) {
  AbsorbResult result;
  result.merged = CopyRegistered(target);
  result.fused = FuseModels(source, target_from_source, options.sim3, &result.merged);
  result.status = result.fused.status;
  if (result.status.ok() && options.verify) result.status = CheckFused(result.fused, options);
  if (result.status.ok() && options.verify) {
    result.status = CheckSharedPhotos(target, source, result.fused.agreeing);
    result.shows_another_place = !result.status.ok();
  }
  if (!result.status.ok()) return result;
  result.seam = SeamOf(result.fused.agreeing, result.merged);
  result.bundle = AdjustSeam(result.seam, options.intrinsics, &result.merged);
  if (!result.bundle.usable)
    result.status = FailedPrecondition("the adjustment of the seam failed");
  if (result.status.ok() && options.verify) {
    result.status = Verify(target, source, options, &result);
  }
  if (result.status.ok()) {
    FilterPoints(PointsSeenBy(result.merged, {result.seam.begin(), result.seam.end()}),
                 &result.merged);
  }
  return result;
}

}  // namespace

void AdaptToFewImages(int num_shared_images, Sim3Options* options) {
  if (num_shared_images >= 3) return;
  options->min_inlier_images = num_shared_images;
  options->min_inlier_ratio = std::max(0.6, options->min_inlier_ratio);
  options->min_common_points = std::max(40, options->min_common_points);
}

Status AbsorbOptions::Check() const {
  return FirstError({sim3.Check(), InRange("min_shared_images", min_shared_images, 0, 1000),
                     InRange("intrinsics.min_images", intrinsics.min_images, 1, 1'000'000)});
}

AbsorbResult Absorb(const Reconstruction& target, const Reconstruction& source,
                    const Similarity& target_from_source, const AbsorbOptions& options) {
  ThrowUnlessSound(options.Check());
  const PossiblePart of_target(target), of_source(source);
  AbsorbResult result =
      AbsorbPossiblePart(of_target.model(), of_source.model(), target_from_source, options);
  for (const PossiblePart* part : {&of_target, &of_source}) {
    for (const ImageId id : part->left_out()) {
      if (!IsRegisteredIn(result.merged, id)) result.left_out.insert(id);
    }
  }
  return result;
}

}  // namespace skein
