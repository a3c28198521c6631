// Submaps of a synthetic wall with known truth: photos 1..24 along it. A photo detects a point with
// a certain probability, always at the same (image, point2D), as real features do. Every submap is
// adjusted, so it is consistent for any intrinsics.
#pragma once

#include "geometry/sim3_similarity.h"
#include "sfm/reconstruction.h"
#include "testing/synthetic_scene.h"

namespace skein {

// 24 photos along a wall, with common points enough to merge submaps.
SyntheticOptions WallOptions(SyntheticOptions::Shape shape = SyntheticOptions::Shape::kWall);

class SyntheticWorld {
 public:
  // `options`: WallOptions, altered; but the seed.
  SyntheticWorld(SyntheticOptions options, unsigned seed);

  double TrueFocalPx() const { return options_.camera.focal_px; }
  CameraPose Pose(int image_id) const;

  // Photos first..last in a frame of their own (submap_from_world), made with a focal length that
  // is wrong by `focal_factor`. If there are two places, photos of both may be put into one submap.
  Reconstruction Submap(int first, int last, const Similarity& submap_from_world,
                        double focal_factor) const;

 private:
  void AddImages(int first, int last, const Similarity& frame, Reconstruction* model) const;
  void AddPoints(int first, int last, const Similarity& frame, Reconstruction* model) const;

  const SyntheticOptions options_;
  const SyntheticScene scene_;
};

}  // namespace skein
