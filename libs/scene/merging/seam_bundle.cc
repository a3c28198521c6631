#include "merging/seam_bundle.h"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "map/bundle_assembly.h"
#include "map/image_pose.h"
#include "map/scene_map.h"

namespace skein {
namespace {

// The `max_neighbours` other photos that have most points in common with the shared ones.
std::set<ImageId> NeighboursOf(const std::set<ImageId>& shared, int max_neighbours,
                               const Reconstruction& model) {
  std::map<ImageId, int> common;
  for (const ImageId id : shared) {
    for (const Point2D& point2D : model.Image(id).Points2D()) {
      if (!point2D.HasPoint3D()) continue;
      for (const auto& element : model.Point3D(point2D.Point3DId()).Track().Elements()) {
        if (!shared.count(element.image_id)) ++common[element.image_id];
      }
    }
  }
  std::vector<std::pair<int, ImageId>> order;
  for (const auto& [id, count] : common) order.emplace_back(-count, id);
  std::sort(order.begin(), order.end());
  std::set<ImageId> neighbours;
  for (const auto& [count, id] : order) {
    if (static_cast<int>(neighbours.size()) >= max_neighbours) break;
    neighbours.insert(id);
  }
  return neighbours;
}

bool MayRefineIntrinsics(CameraId camera_id, const std::set<ImageId>& free_images,
                         const SeamIntrinsics& intrinsics, const Reconstruction& model) {
  if (intrinsics.fixed.count(camera_id) > 0) return false;
  int num_free = 0;
  for (const ImageId id : model.RegImageIds()) {
    if (model.Image(id).CameraId() != camera_id) continue;
    if (free_images.count(id) == 0) return false;
    ++num_free;
  }
  return num_free >= intrinsics.min_images;
}

// Focal length and distortion are refined, if any, the principal point stays, as in COLMAP.
BundleCamera MakeCamera(const Camera& camera, bool refine) {
  BundleCamera result;
  result.camera_id = camera.CameraId();
  result.model_id = camera.ModelId();
  result.params = result.prior = camera.Params();
  result.prior_sigma.assign(result.params.size(), 0.0);
  if (!refine) return result;
  result.square_pixels = camera.HasTwoEqualFocalLengths();
  for (const size_t i : camera.FocalLengthIdxs()) {
    if (i == 0 || !result.square_pixels) result.refined.push_back(static_cast<int>(i));
  }
  for (const size_t i : camera.ExtraParamsIdxs()) result.refined.push_back(static_cast<int>(i));
  return result;
}

Bundle BuildSeam(const std::set<ImageId>& free_images, const SeamIntrinsics& intrinsics,
                 const Reconstruction& model) {
  BundleAssembly assembly(model, [&](CameraId id) {
    return MakeCamera(model.Camera(id), MayRefineIntrinsics(id, free_images, intrinsics, model));
  });
  for (const ImageId id : free_images) assembly.AddPose(id, false);
  const std::vector<Point3DId> points =
      PointsSeenBy(model, {free_images.begin(), free_images.end()});
  for (const Point3DId id : points) {
    for (const TrackElement& element : model.Point3D(id).Track().Elements()) {
      assembly.AddPose(element.image_id, true);
    }
  }
  for (const Point3DId id : points) assembly.AddPoint(id);
  return assembly.Take();
}

}  // namespace

std::set<ImageId> SeamOf(const std::set<ImageId>& agreeing, const Reconstruction& merged,
                         int max_whole_images, int max_neighbours) {
  if (static_cast<int>(merged.NumRegImages()) <= max_whole_images) {
    return {merged.RegImageIds().begin(), merged.RegImageIds().end()};
  }
  std::set<ImageId> seam = NeighboursOf(agreeing, max_neighbours, merged);
  seam.insert(agreeing.begin(), agreeing.end());
  return seam;
}

BundleSummary AdjustSeam(const std::set<ImageId>& free_images, const SeamIntrinsics& intrinsics,
                         Reconstruction* model) {
  BundleOptions solve;
  solve.max_iterations = 30;
  solve.function_tolerance = 1e-5;
  Bundle bundle = BuildSeam(free_images, intrinsics, *model);
  const BundleSummary summary = SolveWithPossibleIntrinsics(solve, *model, &bundle);
  if (summary.usable) ApplyBundle(bundle, model);
  return summary;
}

}  // namespace skein
