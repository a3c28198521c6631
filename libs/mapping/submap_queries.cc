#include <algorithm>

#include "mapping/submap.h"

// What a submap tells of itself.

namespace skein {

SharedImages Submap::ExportShared(const std::vector<int64_t>& image_ids) const {
  SharedImages result;
  for (const int64_t image_id : image_ids) {
    if (!map_->IsRegistered(image_id)) continue;
    const colmap::Image& image = map_->reconstruction().Image(static_cast<ImageId>(image_id));
    const colmap::Camera& camera = map_->reconstruction().Camera(image.CameraId());
    SharedImage shared;
    shared.image_id = image_id;
    shared.camera_model_id = camera.ModelId();
    shared.params = camera.Params();
    shared.width = camera.Width();
    shared.height = camera.Height();
    for (int i = 0; i < 4; ++i) shared.qvec[i] = image.Qvec(i);
    for (int i = 0; i < 3; ++i) shared.tvec[i] = image.Tvec(i);
    for (Point2DIdx i = 0; i < image.NumPoints2D(); ++i) {
      const colmap::Point2D& point2D = image.Point2D(i);
      if (!point2D.HasPoint3D()) continue;
      const Eigen::Vector3d& xyz = map_->reconstruction().Point3D(point2D.Point3DId()).XYZ();
      shared.points.push_back({i,
                               {xyz.x(), xyz.y(), xyz.z()},
                               static_cast<float>(point2D.X()),
                               static_cast<float>(point2D.Y())});
    }
    result.push_back(std::move(shared));
  }
  return result;
}

std::vector<PhotoEvent> Submap::RegisteredEvents() const {
  std::vector<ImageId> ids = map_->reconstruction().RegImageIds();
  std::sort(ids.begin(), ids.end());
  std::vector<PhotoEvent> events;
  for (const ImageId id : ids) {
    PoseEstimate estimate;
    estimate.num_inliers = static_cast<int>(map_->reconstruction().Image(id).NumPoints3D());
    events.push_back(RegisteredEvent(id, estimate));
  }
  return events;
}

SubmapStatistics Submap::Statistics() const {
  SubmapStatistics statistics;
  const colmap::Reconstruction& reconstruction = map_->reconstruction();
  statistics.num_images = static_cast<int>(reconstruction.NumRegImages());
  for (const auto& [id, trial] : side_.trials) {
    statistics.num_deferred += trial.deferred && !map_->IsRegistered(id);
  }
  statistics.num_points = static_cast<int>(reconstruction.NumPoints3D());
  statistics.mean_reprojection_error_px = reconstruction.ComputeMeanReprojectionError();
  statistics.mean_track_length = reconstruction.ComputeMeanTrackLength();
  return statistics;
}

}  // namespace skein
