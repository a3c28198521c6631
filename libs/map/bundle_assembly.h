#pragma once

#include <functional>
#include <unordered_map>
#include <utility>

#include "base/reconstruction.h"
#include "bundle/bundle.h"

namespace skein {

// Puts a bundle together from a part of a COLMAP model, which must outlive it: poses first, then
// the points that they see. A camera comes in, once, with the first pose of it.
class BundleAssembly {
 public:
  using CameraMaker = std::function<BundleCamera(colmap::camera_t)>;

  BundleAssembly(const colmap::Reconstruction& model, CameraMaker make_camera);

  // No effect on an image that is in, or not registered.
  void AddPose(colmap::image_t id, bool constant, double weight = 1.0);

  // With its observations in the poses that are in; a point that fewer than two of them see is left
  // out. But where `hold_open` a point that is also seen from outside is constant, and has those of
  // its observations, one or more, that say something about a pose or camera that is not.
  void AddPoint(colmap::point3D_t id, bool hold_open = false);

  Bundle Take() { return std::move(bundle_); }

 private:
  int CameraIndex(colmap::camera_t id);
  bool IsOpen(const colmap::Track& track) const;
  bool HasUnknowns(const BundlePose& pose) const;

  const colmap::Reconstruction& model_;
  const CameraMaker make_camera_;
  Bundle bundle_;
  std::unordered_map<colmap::image_t, int> pose_index_;
  std::unordered_map<colmap::camera_t, int> camera_index_;
};

}  // namespace skein
