#include "map/bundle_assembly.h"

#include <algorithm>

#include "map/image_pose.h"

namespace skein {

BundleAssembly::BundleAssembly(const Reconstruction& model, CameraMaker make_camera)
    : model_(model), make_camera_(std::move(make_camera)) {}

void BundleAssembly::AddPose(ImageId id, bool constant, const PoseStiffness& stiffness) {
  if (pose_index_.count(id) > 0 || !IsRegisteredIn(model_, id)) return;
  const Image& image = model_.Image(id);
  pose_index_[id] = static_cast<int>(bundle_.poses.size());
  BundlePose pose;
  GetPose(image, &pose);
  pose.camera = CameraIndex(image.CameraId());
  pose.constant = constant;
  pose.stiffness = stiffness;
  bundle_.poses.push_back(pose);
}

int BundleAssembly::CameraIndex(CameraId id) {
  const auto [it, is_new] = camera_index_.emplace(id, bundle_.cameras.size());
  if (is_new) bundle_.cameras.push_back(make_camera_(id));
  return it->second;
}

bool BundleAssembly::IsOpen(const Track& track) const {
  const auto& elements = track.Elements();
  return std::any_of(elements.begin(), elements.end(), [this](const TrackElement& element) {
    return pose_index_.count(element.image_id) == 0;
  });
}

bool BundleAssembly::HasUnknowns(const BundlePose& pose) const {
  return !pose.constant || !bundle_.cameras[pose.camera].refined.empty();
}

void BundleAssembly::AddPoint(Point3DId id, bool hold_open) {
  const Point3D& point3D = model_.Point3D(id);
  BundlePoint point;
  point.point3D_id = id;
  point.xyz = point3D.XYZ();
  point.constant = hold_open && IsOpen(point3D.Track());
  point.first = static_cast<int>(bundle_.observations.size());
  for (const TrackElement& element : point3D.Track().Elements()) {
    const auto it = pose_index_.find(element.image_id);
    if (it == pose_index_.end()) continue;
    if (point.constant && !HasUnknowns(bundle_.poses[it->second])) continue;
    const Image& image = model_.Image(element.image_id);
    bundle_.observations.push_back(
        {it->second, element.point2D_idx, image.Point2D(element.point2D_idx).XY()});
  }
  point.count = static_cast<int>(bundle_.observations.size()) - point.first;
  if (point.count < (point.constant ? 1 : 2)) {
    bundle_.observations.resize(point.first);
  } else {
    bundle_.points.push_back(point);
  }
}

}  // namespace skein
