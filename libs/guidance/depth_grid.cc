#include "guidance/depth_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "guidance/surface.h"

namespace skein {

DepthGrid::DepthGrid(const GuidedCamera& camera, const CameraPose& cam_from_world,
                     double surfel_width, double distance)
    : camera_(camera),
      rotation_(cam_from_world.rotation.toRotationMatrix()),
      translation_(cam_from_world.translation),
      surfel_width_(surfel_width) {
  square_px_ = std::clamp(surfel_width * camera.FocalPx() / distance, 4.0, 0.25 * camera.width_px);
  columns_ = std::max(1, static_cast<int>(std::ceil(camera.width_px / square_px_)));
  rows_ = std::max(1, static_cast<int>(std::ceil(camera.height_px / square_px_)));
  depth_.assign(static_cast<size_t>(columns_) * rows_, std::numeric_limits<float>::infinity());
}

// A surfel covers the squares that a disc of its width meets.
void DepthGrid::Draw(const std::vector<Surfel>& surfels) {
  for (const Surfel& surfel : surfels) {
    const Eigen::Vector3d in_camera = rotation_ * surfel.position + translation_;
    const double depth = in_camera.z();
    if (depth <= 0) continue;
    const double radius = 0.5 * surfel_width_ * camera_.FocalPx() / depth / square_px_;
    const double u = (camera_.fx_px * in_camera.x() / depth + camera_.cx_px) / square_px_;
    const double v = (camera_.fy_px * in_camera.y() / depth + camera_.cy_px) / square_px_;
    if (!(u + radius >= 0 && v + radius >= 0 && u - radius < columns_ && v - radius < rows_)) {
      continue;
    }
    const int column_end = std::min(columns_ - 1, static_cast<int>(u + radius));
    const int row_end = std::min(rows_ - 1, static_cast<int>(v + radius));
    for (int row = std::max(0, static_cast<int>(std::floor(v - radius))); row <= row_end; ++row) {
      for (int column = std::max(0, static_cast<int>(std::floor(u - radius))); column <= column_end;
           ++column) {
        float& nearest = depth_[static_cast<size_t>(row) * columns_ + column];
        nearest = std::min(nearest, static_cast<float>(depth));
      }
    }
  }
}

DepthGrid::Sight DepthGrid::Look(const Eigen::Vector3d& xyz, double tolerance) const {
  const Eigen::Vector3d in_camera = rotation_ * xyz + translation_;
  Eigen::Vector2d pixel;
  if (!camera_.Project(in_camera, &pixel)) return Sight::kOutside;
  const int column = std::min(columns_ - 1, static_cast<int>(pixel.x() / square_px_));
  const int row = std::min(rows_ - 1, static_cast<int>(pixel.y() / square_px_));
  const double nearest = depth_[static_cast<size_t>(row) * columns_ + column];
  return in_camera.z() <= nearest * (1 + tolerance) + surfel_width_ ? Sight::kSeen : Sight::kHidden;
}

}  // namespace skein
