#pragma once

#include <functional>
#include <unordered_map>
#include <utility>

#include "bundle/bundle.h"
#include "sfm/reconstruction.h"

namespace skein {

// Builds a bundle from a part of a model, which must outlive it. Add the poses first, then
// their points. A camera is added with its first pose.
class BundleAssembly {
 public:
  using CameraMaker = std::function<BundleCamera(CameraId)>;

  BundleAssembly(const Reconstruction& model, CameraMaker make_camera);

  // No effect on an image that is in, or not registered.
  void AddPose(ImageId id, bool constant, const PoseStiffness& stiffness = {});

  // Adds the point with its observations in the added poses. A point with less than two of them is
  // left out. With `hold_open` a point that other images observe, too, is constant. For such a
  // constant point only observations in free poses or free cameras are added, and one is enough.
  void AddPoint(Point3DId id, bool hold_open = false);

  Bundle Take() { return std::move(bundle_); }

 private:
  int CameraIndex(CameraId id);
  bool IsOpen(const Track& track) const;
  bool HasUnknowns(const BundlePose& pose) const;

  const Reconstruction& model_;
  const CameraMaker make_camera_;
  Bundle bundle_;
  std::unordered_map<ImageId, int> pose_index_;
  std::unordered_map<CameraId, int> camera_index_;
};

}  // namespace skein
