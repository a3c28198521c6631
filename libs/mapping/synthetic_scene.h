#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "map/scene_map.h"

namespace skein {

constexpr double kTwinShift = 2.2;  // along x

// A scene for tests: points, cameras that look at them, exact correspondences with noise and
// outliers. All from one seed.
struct SyntheticOptions {
  // kTwins: the second half of the points is the first, shifted: a structure that repeats.
  enum class Shape { kBox, kPlane, kTwins };
  // kArcThenForward: from the middle on straight ahead.
  enum class Path { kArc, kForward, kRotation, kArcThenForward };
  unsigned seed = 1;
  int num_points = 600;
  int num_photos = 8;
  Shape shape = Shape::kBox;
  Path path = Path::kArc;
  double step_deg = 8;  // arc and rotation: between photos
  // This photo stands where the one before does, but for the distance, and is turned by 8 degrees.
  int turned_photo = -1;
  double turned_distance = 0;
  std::vector<int> zoomed_photos;  // taken with 1.3 times the focal length, as the same camera
  double focal_px = 1000;
  double distortion = 0;    // SIMPLE_RADIAL's k
  double prior_factor = 1;  // of the focal prior
  bool focal_from_exif = true;
  double noise_px = 0.3;
  double outlier_ratio = 0;  // of a pair's matches
};

struct SyntheticScene {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Matrix3d> rotations;  // cam_from_world
  std::vector<Eigen::Vector3d> translations;
  std::vector<PhotoInput> photos;         // ids from 1; keypoint i sees visible[photo][i]
  std::vector<std::vector<int>> visible;  // point of each keypoint
  // Pairs of a photo with all earlier ones with at least 15 common points.
  std::vector<TwoViewPairs> pairs;

  Eigen::Vector3d Center(size_t photo) const {
    return -(rotations[photo].transpose() * translations[photo]);
  }
};

SyntheticScene MakeScene(const SyntheticOptions& options);

// All photos with these pairs (of each photo, as SyntheticScene::pairs), none registered.
void AddToMap(const SyntheticScene& scene, const std::vector<TwoViewPairs>& pairs, SceneMap* map);

// Registers photos that are in the map where they truly are, but for `shift`, with a track for each
// point that two of them see.
void RegisterAtTruth(const SyntheticScene& scene, const std::vector<ImageId>& ids,
                     const Eigen::Vector3d& shift, SceneMap* map);

}  // namespace skein
