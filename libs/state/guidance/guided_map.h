// A submap as guidance reads it: cameras, photos and points, without keypoints.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "formats/texture_fields.h"
#include "geometry/sim3_similarity.h"

namespace skein {

// A pinhole camera; distortion is left out.
struct GuidedCamera {
  int width_px = 0, height_px = 0;
  double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;

  // Projects a point given in the camera's frame. False if the point is behind the camera or
  // outside the photo.
  bool Project(const Eigen::Vector3d& in_camera, Eigen::Vector2d* pixel) const;
  double FocalPx() const { return 0.5 * (fx_px + fy_px); }
};

struct GuidedPhoto {
  int64_t image_id = 0;
  int32_t camera = 0;  // index into GuidedMap::cameras
  int32_t agent = 0;   // any number that tells agents apart
  CameraPose cam_from_world;
  std::optional<TextureFields> texture = std::nullopt;  // nullopt: not known
};

struct GuidedPoint {
  Eigen::Vector3d xyz = Eigen::Vector3d::Zero();
  std::vector<uint32_t> photos;  // that observe it: indices into GuidedMap::photos
};

constexpr double kRadian = 0.017453292519943295;  // a degree

// Points of a map that are assessed: the guide's default, and the report's limit.
constexpr int64_t kMaxGuidedPoints = 300'000;

// Lengths are in the submap's own unit.
struct GuidedMap {
  std::vector<GuidedCamera> cameras;
  std::vector<GuidedPhoto> photos;  // in the order they came
  std::vector<GuidedPoint> points;
};

// Unit directions of a photo in the map's frame: where it looks, its right and its upper side.
Eigen::Vector3d AheadOf(const CameraPose& pose);
Eigen::Vector3d RightOf(const CameraPose& pose);
Eigen::Vector3d UpperSideOf(const CameraPose& pose);

// How far one photo is from another, in working distances; a turn by a radian is as far as one.
double HowFar(const CameraPose& from, const CameraPose& to, double working_distance);

// Upwards as the photos tell: their own upper sides where these agree (photos held level), else
// against where they look (straight down). Across their horizontal sides, as in Brown and Lowe 2007
// (section 5): photos that all look up a little do not tilt it, once they look in several
// directions. Unit.
Eigen::Vector3d UpOf(const GuidedMap& map);

}  // namespace skein
