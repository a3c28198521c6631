// Submaps of a synthetic place with known truth, for the tests of merging: a wall with relief, and
// photos 1..24 along it. A photo detects a point with a certain probability, always at the same
// (image, point2D), as real features do; every submap is adjusted, so that it is consistent in
// itself whatever its intrinsics are.
#pragma once

#include <cstdint>
#include <vector>

#include "base/reconstruction.h"
#include "geometry/sim3_similarity.h"

namespace skein {

struct SyntheticOptions {
  int num_images = 24;
  int num_points = 3000;
  double detection_rate = 0.7;
  double noise_px = 0.5;
  int second_camera_from = 0;  // photos from here on have camera 2; 0: all have camera 1
  // Two places with one façade: photos up to 12 stand in the first, the others in the second. Each
  // place has surroundings of its own.
  bool twin = false;
};

class SyntheticWorld {
 public:
  SyntheticWorld(const SyntheticOptions& options, uint64_t seed);

  double TrueFocalPx() const { return 1300.0; }
  CameraPose Pose(int image_id) const { return poses_.at(image_id - 1); }

  // Photos first..last in a frame of their own (submap_from_world), made with a focal length that
  // is wrong by `focal_factor`. In a twin world, photos of both places may be put into one submap.
  colmap::Reconstruction Submap(int first, int last, const Similarity& submap_from_world,
                                double focal_factor) const;

 private:
  struct Keypoint {
    int point = -1;  // index of the world's point, -1: clutter
    Eigen::Vector2d pixel;
  };
  int CameraOf(int image_id) const;
  void MakePoints(uint64_t seed);
  void MakePoses(uint64_t seed);
  void Photograph(uint64_t seed);
  colmap::Camera TrueCamera() const;
  bool Stands(int image_id, int point) const;
  void AddImages(int first, int last, const Similarity& frame, colmap::Reconstruction* model) const;
  void AddPoints(int first, int last, const Similarity& frame, colmap::Reconstruction* model) const;

  SyntheticOptions options_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<int> places_;  // of each point: 0 both, 1 the first place, 2 the second
  std::vector<CameraPose> poses_;
  std::vector<std::vector<Keypoint>> keypoints_;  // of each photo
};

}  // namespace skein
