// Dense points by a plane sweep, as the measure of what a map's photos can give. For benchmarks:
// plain on purpose, so that it says the same of photos as any dense matching by windows would.
//
// A reference photo's neighbours are warped by the homographies of planes in front of it (Collins
// 1996, "A space-sweep approach to true multi-image matching"), the planes evenly spaced in inverse
// depth. A plane's score at a pixel is the mean ZNCC of the better half of the neighbours.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "geometry/sim3_similarity.h"

namespace skein {

// A photo of a pinhole camera. The centre of the upper left pixel is (0.5, 0.5).
struct SweepPhoto {
  cv::Mat1f grey;  // 0 to 255
  double focal_px = 0;
  Eigen::Vector2d principal_point = Eigen::Vector2d::Zero();
  CameraPose cam_from_world;
  double near = 0, far = 0;     // depths to search, 0 < near < far
  std::vector<int> neighbours;  // to match with: indices of photos
};

// Depth of each pixel, 0 where none was found. Throws std::invalid_argument for depths that are not
// sound.
cv::Mat1f SweepDepth(const std::vector<SweepPhoto>& photos, int reference);

// World points of the reference's depth map that two depth maps of `others` agree with, tried at
// every second pixel both ways. `depths` is in the order of `photos`; one that is empty agrees with
// nothing.
std::vector<Eigen::Vector3d> ConsistentPoints(const std::vector<SweepPhoto>& photos,
                                              const std::vector<cv::Mat1f>& depths, int reference,
                                              const std::vector<int>& others);

}  // namespace skein
