#include "merging/seam_bundle.h"

#include "map/bundle_assembly.h"
#include "map/image_pose.h"

namespace skein {
namespace {

using colmap::camera_t;
using colmap::image_t;
using colmap::point3D_t;

std::set<point3D_t> PointsSeenBy(const std::set<image_t>& images,
                                 const colmap::Reconstruction& model) {
  std::set<point3D_t> ids;
  for (const image_t id : images) {
    for (const colmap::Point2D& point2D : model.Image(id).Points2D()) {
      if (point2D.HasPoint3D()) ids.insert(point2D.Point3DId());
    }
  }
  return ids;
}

bool MayRefineIntrinsics(camera_t camera_id, const std::set<image_t>& free_images,
                         const SeamIntrinsics& intrinsics, const colmap::Reconstruction& model) {
  if (intrinsics.fixed.count(camera_id) > 0) return false;
  int num_free = 0;
  for (const image_t id : model.RegImageIds()) {
    if (model.Image(id).CameraId() != camera_id) continue;
    if (free_images.count(id) == 0) return false;
    ++num_free;
  }
  return num_free >= intrinsics.min_images;
}

// Focal length and distortion are refined, if any, the principal point stays, as in COLMAP.
BundleCamera MakeCamera(const colmap::Camera& camera, bool refine) {
  BundleCamera result;
  result.camera_id = camera.CameraId();
  result.model_id = camera.ModelId();
  result.params = result.prior = camera.Params();
  result.prior_sigma.assign(result.params.size(), 0.0);
  if (!refine) return result;
  for (const size_t i : camera.FocalLengthIdxs()) result.refined.push_back(static_cast<int>(i));
  for (const size_t i : camera.ExtraParamsIdxs()) result.refined.push_back(static_cast<int>(i));
  return result;
}

Bundle BuildSeam(const std::set<image_t>& free_images, const SeamIntrinsics& intrinsics,
                 const colmap::Reconstruction& model) {
  BundleAssembly assembly(model, [&](camera_t id) {
    return MakeCamera(model.Camera(id), MayRefineIntrinsics(id, free_images, intrinsics, model));
  });
  for (const image_t id : free_images) assembly.AddPose(id, false);
  const std::set<point3D_t> points = PointsSeenBy(free_images, model);
  for (const point3D_t id : points) {
    for (const colmap::TrackElement& element : model.Point3D(id).Track().Elements()) {
      assembly.AddPose(element.image_id, true);
    }
  }
  for (const point3D_t id : points) assembly.AddPoint(id);
  return assembly.Take();
}

}  // namespace

BundleSummary AdjustSeam(const std::set<image_t>& free_images, const SeamIntrinsics& intrinsics,
                         colmap::Reconstruction* model) {
  Bundle bundle = BuildSeam(free_images, intrinsics, *model);
  BundleOptions solve;
  solve.max_iterations = 30;
  solve.function_tolerance = 1e-5;
  const BundleSummary summary = SolveBundle(solve, &bundle);
  if (summary.usable) ApplyBundle(bundle, model);
  return summary;
}

}  // namespace skein
