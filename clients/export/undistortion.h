// Photos as a camera without distortion would have taken them.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "core/result.h"
#include "sfm/camera.h"

namespace skein {

// From a camera of any of COLMAP's models to one of PINHOLE with the same focal lengths and the
// principal point in the middle of the photo, as programs want it that know a field of view alone.
//
// Its sides are the longest that leave no border, as in COLMAP's UndistortCamera with blank_pixels
// = 0, at most twice the photo's. If the distortion cannot be inverted up to the photo's edges, the
// photo covers only the part where it can, and has borders.
class Undistortion {
 public:
  // Error: the parameters are absurd even in the middle of the photo.
  static Result<Undistortion> Of(const Camera& camera);

  // Whether Of(camera) may have borders, at the cost of the photo's edges alone.
  static bool MayHaveBorders(const Camera& camera);

  // PINHOLE, with the id of the camera.
  const Camera& camera() const { return pinhole_; }

  // Bilinear; black in borders. The photo has the size of the camera (std::invalid_argument).
  cv::Mat3b Apply(const cv::Mat3b& photo) const;

  // Pixels, the centre of the upper-left one is 0.5, 0.5.
  Eigen::Vector2d Apply(const Eigen::Vector2d& point) const;

  // 255 where the photo shows something, 0 in borders.
  const cv::Mat1b& mask() const { return mask_; }
  bool has_borders() const { return has_borders_; }

 private:
  explicit Undistortion(const Camera& camera);
  void SetSize(cv::Size size);
  void Map();
  cv::Mat1b Valid() const;
  Status Crop();

  const Camera distorted_;
  Camera pinhole_;
  cv::Mat1f map_x_, map_y_;  // OpenCV's pixels, whose upper-left centre is 0, 0
  cv::Mat1b mask_;
  bool has_borders_ = false;
};

}  // namespace skein
