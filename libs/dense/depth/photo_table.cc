#include "depth/photo_table.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace skein {
namespace {

Eigen::Vector2d Scales(const LensCamera& lens, const DepthCamera& camera) {
  return {static_cast<double>(camera.width) / lens.width,
          static_cast<double>(camera.height) / lens.height};
}

}  // namespace

DepthCamera PhotoTable::CameraOf(const LensCamera& lens, int longer_side_px) {
  if (lens.width < 1 || lens.height < 1 || longer_side_px < 1 || !(lens.focal_px.minCoeff() > 0)) {
    throw std::invalid_argument("depth map: sizes and focal lengths are above 0");
  }
  const double scale =
      std::min(1.0, static_cast<double>(longer_side_px) / std::max(lens.width, lens.height));
  DepthCamera camera;
  camera.width = std::max(1, static_cast<int>(std::lround(scale * lens.width)));
  camera.height = std::max(1, static_cast<int>(std::lround(scale * lens.height)));
  const Eigen::Vector2d scales = Scales(lens, camera);
  camera.focal_px = lens.focal_px.cwiseProduct(scales);
  camera.principal_point_px = lens.principal_point_px.cwiseProduct(scales);
  return camera;
}

PhotoTable::PhotoTable(const LensCamera& lens, int longer_side_px)
    : photo_width_(lens.width),
      photo_height_(lens.height),
      camera_(CameraOf(lens, longer_side_px)) {
  const Eigen::Vector2d scales = Scales(lens, camera_);
  const cv::Size size(camera_.width, camera_.height);
  x_ = cv::Mat1f(size, -1.0f);
  y_ = cv::Mat1f(size, -1.0f);
  valid_ = cv::Mat1b(size, 0);
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      const auto pixel = lens.project(camera_.Ray({u + 0.5, v + 0.5}));
      if (!pixel || !pixel->allFinite()) continue;
      const Eigen::Vector2d at = pixel->cwiseProduct(scales).array() - 0.5;
      x_(v, u) = static_cast<float>(at.x());
      y_(v, u) = static_cast<float>(at.y());
      const bool is_inside =
          at.minCoeff() >= -0.5 && at.x() <= size.width - 0.5 && at.y() <= size.height - 0.5;
      if (is_inside) valid_(v, u) = 255;
    }
  }
  KeepFirstSight();
}

// A polynomial of the radius that turns back shows the photo's content a second time, and beyond
// its zero a third time, turned by 180 degrees.
void PhotoTable::KeepFirstSight() {
  if (valid_.cols < 2 || valid_.rows < 2) return;
  for (int v = 0; v < valid_.rows; ++v) {
    for (int u = 0; u < valid_.cols; ++u) {
      if (!KeepsOrientation(std::max(u, 1), std::max(v, 1))) valid_(v, u) = 0;
    }
  }
  cv::Mat1i parts;
  cv::connectedComponents(valid_, parts, 4);
  const Eigen::Vector2d& middle = camera_.principal_point_px;
  const int u = static_cast<int>(std::clamp(middle.x(), 0.0, valid_.cols - 1.0));
  const int v = static_cast<int>(std::clamp(middle.y(), 0.0, valid_.rows - 1.0));
  valid_.setTo(0, parts != parts(v, u));
}

bool PhotoTable::KeepsOrientation(int u, int v) const {
  const float dxu = x_(v, u) - x_(v, u - 1), dyu = y_(v, u) - y_(v, u - 1);
  const float dxv = x_(v, u) - x_(v - 1, u), dyv = y_(v, u) - y_(v - 1, u);
  return dxu * dyv - dxv * dyu > 0;
}

bool PhotoTable::IsOfCamera(cv::Size photo) const {
  if (photo.width < 1) return false;
  const int reduction = (photo_width_ + photo.width - 1) / photo.width;
  const auto reduced = [reduction](int side) { return (side + reduction - 1) / reduction; };
  return photo == cv::Size(reduced(photo_width_), reduced(photo_height_));
}

cv::Mat PhotoTable::Undistort(const cv::Mat& photo) const {
  if (!IsOfCamera(photo.size())) {
    throw std::invalid_argument("depth map: the photo has not its camera's size");
  }
  cv::Mat small = photo, undistorted;
  if (small.size() != valid_.size()) cv::resize(photo, small, valid_.size(), 0, 0, cv::INTER_AREA);
  cv::remap(small, undistorted, x_, y_, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  return undistorted;
}

DepthPhoto PhotoTable::Apply(const cv::Mat1b& photo, const DepthPose& cam_from_world) const {
  return {Undistort(photo), valid_, camera_, cam_from_world};
}

cv::Mat3b PhotoTable::Apply(const cv::Mat3b& photo) const { return Undistort(photo); }

}  // namespace skein
