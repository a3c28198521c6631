// The one generator of scenes for tests and benchmarks: points, cameras that look at them, noisy
// keypoints, clutter, correspondences with outliers. One seed determines all. synthetic_features.h
// adds descriptors, synthetic_submaps.h makes models of it.
#pragma once

#include <random>
#include <vector>

#include "bundle/bundle.h"
#include "map/scene_map.h"

namespace skein {

constexpr double kTwinShift = 2.2;    // along x
constexpr double kWallLength = 20.0;  // of the photos' path along a wall

struct SyntheticCamera {
  int width_px = 1200;
  int height_px = 900;
  double focal_px = 1000;
  double distortion = 0;  // SIMPLE_RADIAL's k
};

struct SyntheticOptions {
  // kTwins: the second half of the points is the first, shifted: a structure that repeats.
  // kWall: with relief, photographed while walking along it (`path` is not asked).
  // kTwoPlaces: two walls with one façade above surroundings of their own; photos 1 to 12 stand
  // before the first, the others before the second.
  enum class Shape { kBox, kPlane, kTwins, kWall, kTwoPlaces };
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
  std::vector<int> zoomed_photos;  // taken with `zoom` times the focal length, as the same camera
  double zoom = 1.3;
  int second_camera_from = 0;  // photos with this id and later have camera 2; 0: none has
  SyntheticCamera camera;
  double prior_factor = 1;  // of the focal prior
  bool focal_from_exif = true;
  double noise_px = 0.3;
  double detection_rate = 1;  // a point in view becomes a keypoint with this probability
  int num_clutter = 0;        // keypoints of a photo that see no point
  double outlier_ratio = 0;   // of a pair's matches
  int max_pairs = 0;          // of a photo, with the latest ones before it; 0: no limit
};

struct SyntheticScene {
  // Points and poses of the scene, which Photograph takes.
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Matrix3d> rotations;  // cam_from_world
  std::vector<Eigen::Vector3d> translations;
  // A photo sees the points of its own place and those of place 0. Empty: all are of place 0.
  std::vector<int> place_of_point;
  std::vector<int> place_of_photo;
  // Probability that a point in view becomes a keypoint. Empty: SyntheticOptions::detection_rate.
  std::vector<double> detection_of_point;

  std::vector<PhotoInput> photos;         // ids from 1; keypoint i sees visible[photo][i]
  std::vector<std::vector<int>> visible;  // point of each keypoint, ascending; last -1: clutter
  // Pairs of a photo with the earlier ones that have at least 15 points in common with it.
  std::vector<TwoViewPairs> pairs;

  Eigen::Vector3d Center(size_t photo) const {
    return -(rotations[photo].transpose() * translations[photo]);
  }
  void AddPose(const Eigen::Matrix3d& cam_from_world, const Eigen::Vector3d& center) {
    rotations.push_back(cam_from_world);
    translations.push_back(-(cam_from_world * center));
  }
};

SyntheticScene MakeScene(const SyntheticOptions& options);

// Photos and pairs of a scene whose points and poses are given. Only camera, noise, detection,
// clutter and outliers of the options count.
void Photograph(const SyntheticOptions& options, std::mt19937* random, SyntheticScene* scene);

// The same for the first pose without a photo. Earlier photos need `visible` only if pairs are made
// with them.
void PhotographNext(const SyntheticOptions& options, std::mt19937* random, SyntheticScene* scene);

// All photos with these pairs (of each photo, as SyntheticScene::pairs), none registered.
void AddToMap(const SyntheticScene& scene, const std::vector<TwoViewPairs>& pairs, SceneMap* map);

// Registers photos of the map at their true poses plus `shift`, with a track for each point that
// two of them see.
void RegisterAtTruth(const SyntheticScene& scene, const std::vector<ImageId>& ids,
                     const Eigen::Vector3d& shift, SceneMap* map);

// The whole scene: all photos with all their pairs, registered at their true poses.
void FillMap(const SyntheticScene& scene, SceneMap* map);

// A bundle of a scene with one camera, at the truth: all poses, and the points that two of them
// see. Nothing is held.
Bundle BundleAtTruth(const SyntheticOptions& options, const SyntheticScene& scene);

// Number of `points` that the image observes.
size_t NumSeen(const SceneMap& map, const std::vector<Point3DId>& points, ImageId id);

}  // namespace skein
