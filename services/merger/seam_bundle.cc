#include "merger/seam_bundle.h"

#include <unordered_map>
#include <vector>

#include "bundle/image_pose.h"

namespace skein {
namespace {

using colmap::camera_t;
using colmap::image_t;
using colmap::point3D_t;

class Builder {
 public:
  Builder(const std::set<image_t>& free_images, const SeamOptions& options,
          const colmap::Reconstruction& model)
      : free_images_(free_images), options_(options), model_(model) {}

  Bundle Build() {
    for (const image_t id : free_images_) PoseIndex(id);
    for (const point3D_t id : PointsOfFreeImages()) AddPoint(id);
    return std::move(bundle_);
  }

 private:
  std::set<point3D_t> PointsOfFreeImages() const {
    std::set<point3D_t> ids;
    for (const image_t id : free_images_) {
      for (const colmap::Point2D& point2D : model_.Image(id).Points2D()) {
        if (point2D.HasPoint3D()) ids.insert(point2D.Point3DId());
      }
    }
    return ids;
  }

  int PoseIndex(image_t id) {
    const auto [it, is_new] = pose_index_.emplace(id, bundle_.poses.size());
    if (is_new) {
      const colmap::Image& image = model_.Image(id);
      BundlePose pose;
      GetPose(image, &pose);
      pose.camera = CameraIndex(image.CameraId());
      pose.constant = free_images_.count(id) == 0;
      bundle_.poses.push_back(pose);
    }
    return it->second;
  }

  // Focal length and distortion are refined, the principal point stays, as in COLMAP.
  int CameraIndex(camera_t id) {
    const auto [it, is_new] = camera_index_.emplace(id, bundle_.cameras.size());
    if (is_new) {
      const colmap::Camera& camera = model_.Camera(id);
      BundleCamera result;
      result.camera_id = id;
      result.model_id = camera.ModelId();
      result.params = result.prior = camera.Params();
      result.prior_sigma.assign(result.params.size(), 0.0);
      if (MayRefineIntrinsics(id)) {
        for (const size_t i : camera.FocalLengthIdxs())
          result.refined.push_back(static_cast<int>(i));
        for (const size_t i : camera.ExtraParamsIdxs())
          result.refined.push_back(static_cast<int>(i));
      }
      bundle_.cameras.push_back(std::move(result));
    }
    return it->second;
  }

  bool MayRefineIntrinsics(camera_t camera_id) const {
    int num_free = 0;
    for (const image_t id : model_.RegImageIds()) {
      if (model_.Image(id).CameraId() != camera_id) continue;
      if (free_images_.count(id) == 0) return false;
      ++num_free;
    }
    return num_free >= options_.min_images_for_intrinsics;
  }

  void AddPoint(point3D_t id) {
    const colmap::Point3D& point3D = model_.Point3D(id);
    BundlePoint point;
    point.point3D_id = id;
    point.xyz = point3D.XYZ();
    point.first = static_cast<int>(bundle_.observations.size());
    for (const colmap::TrackElement& element : point3D.Track().Elements()) {
      const colmap::Image& image = model_.Image(element.image_id);
      if (!image.IsRegistered()) continue;
      bundle_.observations.push_back({PoseIndex(element.image_id), element.point2D_idx,
                                      image.Point2D(element.point2D_idx).XY()});
    }
    point.count = static_cast<int>(bundle_.observations.size()) - point.first;
    bundle_.points.push_back(point);
  }

  const std::set<image_t>& free_images_;
  const SeamOptions& options_;
  const colmap::Reconstruction& model_;
  Bundle bundle_;
  std::unordered_map<image_t, int> pose_index_;
  std::unordered_map<camera_t, int> camera_index_;
};

}  // namespace

BundleSummary AdjustSeam(const std::set<image_t>& free_images, const SeamOptions& options,
                         colmap::Reconstruction* model) {
  Bundle bundle = Builder(free_images, options, *model).Build();
  BundleOptions solve;
  solve.max_iterations = options.max_iterations;
  solve.function_tolerance = options.function_tolerance;
  solve.num_threads = options.num_threads;
  solve.loss = Loss::kSoftL1;
  solve.loss_scale_px = options.loss_scale_px;
  const BundleSummary summary = SolveBundle(solve, &bundle);
  if (summary.usable) ApplyBundle(bundle, model);
  return summary;
}

}  // namespace skein
