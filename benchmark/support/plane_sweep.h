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

#include "core/result.h"
#include "geometry/sim3_similarity.h"

namespace skein {

struct SweepOptions {
  int window_px = 7;         // odd
  double plane_step_px = 1;  // between planes, in the neighbour where it is largest
  int max_planes = 120;
  double min_zncc = 0.6;
  double min_contrast = 1.5;  // standard deviation of the reference's window, grey levels
  // A point stays where this many depth maps of other photos agree with it.
  int min_agreeing = 2;
  double max_reprojection_px = 1;
  double max_depth_difference = 0.01;  // part of the depth
  int stride_px = 2;                   // a point is tried at every so many pixels, both ways

  Status Check() const;
};

// A photo of a pinhole camera. The centre of the upper left pixel is (0.5, 0.5).
struct SweepPhoto {
  cv::Mat1f grey;  // 0 to 255
  double focal_px = 0;
  Eigen::Vector2d principal_point = Eigen::Vector2d::Zero();
  CameraPose cam_from_world;
  double near = 0, far = 0;     // depths to search, 0 < near < far
  std::vector<int> neighbours;  // to match with: indices of photos
};

// Depth of each pixel, 0 where none was found. Throws std::invalid_argument for options or depths
// that are not sound.
cv::Mat1f SweepDepth(const SweepOptions& options, const std::vector<SweepPhoto>& photos,
                     int reference);

// World points of the reference's depth map that enough depth maps of `others` agree with. `depths`
// is in the order of `photos`; one that is empty agrees with nothing.
std::vector<Eigen::Vector3d> ConsistentPoints(const SweepOptions& options,
                                              const std::vector<SweepPhoto>& photos,
                                              const std::vector<cv::Mat1f>& depths, int reference,
                                              const std::vector<int>& others);

}  // namespace skein
