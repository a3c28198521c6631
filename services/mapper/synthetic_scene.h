#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "mapper/scene_map.h"

namespace skein {

// A scene for tests: points, cameras that look at them, exact correspondences with noise and
// outliers. All from one seed.
struct SyntheticOptions {
  enum class Shape { kBox, kPlane };
  enum class Path { kArc, kForward, kRotation };
  unsigned seed = 1;
  int num_points = 600;
  int num_photos = 8;
  Shape shape = Shape::kBox;
  Path path = Path::kArc;
  double step_deg = 8;  // arc and rotation: between photos
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

}  // namespace skein
