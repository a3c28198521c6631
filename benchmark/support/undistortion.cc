#include "benchmark/support/undistortion.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>

namespace skein {
namespace {

Camera Shrink(Camera camera, int width) {
  const double scale =
      static_cast<double>(width) / static_cast<double>(std::max(camera.Width(), camera.Height()));
  camera.Rescale(static_cast<size_t>(std::lround(scale * camera.Width())),
                 static_cast<size_t>(std::lround(scale * camera.Height())));
  return camera;
}

}  // namespace

Undistortion::Undistortion(const Camera& camera, int width)
    : original_(camera), small_(Shrink(camera, width)) {
  pinhole_ = {static_cast<int>(small_.Width()), static_cast<int>(small_.Height()),
              small_.MeanFocalLength(),         small_.MeanFocalLength(),
              small_.PrincipalPointX(),         small_.PrincipalPointY()};
  while (!BorderLiesInPhoto()) {
    pinhole_.fx_px = pinhole_.fy_px = 1.01 * pinhole_.fx_px;
    if (pinhole_.fx_px > 2 * small_.MeanFocalLength()) {
      throw std::runtime_error("camera " + std::to_string(camera.CameraId()) +
                               ": its distortion is too large for a pinhole camera");
    }
  }
}

Eigen::Vector2d Undistortion::InSmallPhoto(double x, double y) const {
  return small_.WorldToImage(
      {(x - pinhole_.cx_px) / pinhole_.fx_px, (y - pinhole_.cy_px) / pinhole_.fy_px});
}

bool Undistortion::LiesInPhoto(double x, double y) const {
  constexpr double kSlack = 0.01;
  const Eigen::Vector2d at = InSmallPhoto(x, y);
  return at.x() > 0.5 - kSlack && at.y() > 0.5 - kSlack &&
         at.x() < pinhole_.width_px - 0.5 + kSlack && at.y() < pinhole_.height_px - 0.5 + kSlack;
}

bool Undistortion::BorderLiesInPhoto() const {
  const double right = pinhole_.width_px - 0.5, bottom = pinhole_.height_px - 0.5;
  for (double x = 0.5; x <= right; ++x) {
    if (!LiesInPhoto(x, 0.5) || !LiesInPhoto(x, bottom)) return false;
  }
  for (double y = 0.5; y <= bottom; ++y) {
    if (!LiesInPhoto(0.5, y) || !LiesInPhoto(right, y)) return false;
  }
  return true;
}

Eigen::Vector2d Undistortion::Pixel(const Eigen::Vector2d& original) const {
  const Eigen::Vector2d ray = original_.ImageToWorld(original);
  return {pinhole_.fx_px * ray.x() + pinhole_.cx_px, pinhole_.fy_px * ray.y() + pinhole_.cy_px};
}

cv::Mat1b Undistortion::Photo(const cv::Mat1b& photo) const {
  const cv::Size size(pinhole_.width_px, pinhole_.height_px);
  cv::Mat1b small, undistorted;
  cv::resize(photo, small, size, 0, 0, cv::INTER_AREA);
  cv::Mat1f from_x(size), from_y(size);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const Eigen::Vector2d from = InSmallPhoto(x + 0.5, y + 0.5);
      from_x(y, x) = static_cast<float>(from.x() - 0.5);
      from_y(y, x) = static_cast<float>(from.y() - 0.5);
    }
  }
  cv::remap(small, undistorted, from_x, from_y, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  return undistorted;
}

}  // namespace skein
