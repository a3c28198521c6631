// A photo as a pinhole camera would have taken it.
#pragma once

#include <opencv2/core.hpp>

#include "guidance/guided_map.h"
#include "sfm/camera.h"

namespace skein {

class Undistortion {
 public:
  // `width`: of the longer side, in pixels. The focal length is the camera's, or as much longer as
  // it takes for every pixel to lie in the photo. Throws std::runtime_error where twice is not
  // enough.
  Undistortion(const Camera& camera, int width);

  const GuidedCamera& camera() const { return pinhole_; }

  // From a pixel of the original photo. The centre of the upper left one is (0.5, 0.5).
  Eigen::Vector2d Pixel(const Eigen::Vector2d& original) const;

  // `photo`: of the camera's size.
  cv::Mat1b Photo(const cv::Mat1b& photo) const;

 private:
  bool LiesInPhoto(double x, double y) const;
  bool BorderLiesInPhoto() const;
  Eigen::Vector2d InSmallPhoto(double x, double y) const;

  const Camera original_;
  Camera small_;  // the original one, of the size that is wanted
  GuidedCamera pinhole_;
};

}  // namespace skein
