#include "guidance/depth_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "guidance/surface.h"
#include "guidance/surfel_blocks.h"

namespace skein {

Eigen::Matrix3Xf PositionsOf(const std::vector<Surfel>& surfels) {
  Eigen::Matrix3Xf positions(3, static_cast<Eigen::Index>(surfels.size()));
  for (size_t i = 0; i < surfels.size(); ++i) {
    positions.col(static_cast<Eigen::Index>(i)) = surfels[i].position.cast<float>();
  }
  return positions;
}

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
  const double right = columns_ * square_px_ - camera.cx_px;
  const double bottom = rows_ * square_px_ - camera.cy_px;
  sides_ = {Eigen::Vector3d(camera.fx_px, 0, -right).normalized(),
            Eigen::Vector3d(-camera.fx_px, 0, -camera.cx_px).normalized(),
            Eigen::Vector3d(0, camera.fy_px, -bottom).normalized(),
            Eigen::Vector3d(0, -camera.fy_px, -camera.cy_px).normalized()};
}

void DepthGrid::DrawDisc(float u, float v, float radius, float depth) {
  const int column_begin = std::max(0, static_cast<int>(std::floor(u - radius)));
  const int column_end = std::min(columns_ - 1, static_cast<int>(u + radius));
  const int row_end = std::min(rows_ - 1, static_cast<int>(v + radius));
  for (int row = std::max(0, static_cast<int>(std::floor(v - radius))); row <= row_end; ++row) {
    for (int column = column_begin; column <= column_end; ++column) {
      float& nearest = depth_[static_cast<size_t>(row) * columns_ + column];
      nearest = std::min(nearest, depth);
    }
  }
}

// A surfel covers the squares that a disc of its width meets. Most surfels are outside of the
// frame, so many at once are projected.
void DepthGrid::Draw(const Positions& positions, std::vector<InFrame>* in_frame) {
  constexpr Eigen::Index kBlock = 256;
  const Eigen::Matrix3f rotation = rotation_.cast<float>();
  const Eigen::Vector3f translation = translation_.cast<float>();
  const auto squares = [&](double px) { return static_cast<float>(px / square_px_); };
  const float fx = squares(camera_.fx_px), fy = squares(camera_.fy_px);
  const float cx = squares(camera_.cx_px), cy = squares(camera_.cy_px);
  const float width = squares(camera_.width_px), height = squares(camera_.height_px);
  const float radius_at_1 = squares(0.5 * surfel_width_ * camera_.FocalPx());
  const auto num_columns = static_cast<float>(columns_), num_rows = static_cast<float>(rows_);
  Eigen::Matrix<float, Eigen::Dynamic, 3, 0, kBlock, 3> in_camera;
  Eigen::Array<float, Eigen::Dynamic, 1, 0, kBlock, 1> u, v, radius;
  for (Eigen::Index begin = 0; begin < positions.cols(); begin += kBlock) {
    const Eigen::Index count = std::min(kBlock, positions.cols() - begin);
    in_camera.noalias() = positions.middleCols(begin, count).transpose() * rotation.transpose();
    in_camera.rowwise() += translation.transpose();
    const auto depth = in_camera.col(2).array();
    u = fx * in_camera.col(0).array() / depth + cx;
    v = fy * in_camera.col(1).array() / depth + cy;
    radius = radius_at_1 / depth;
    for (Eigen::Index i = 0; i < count; ++i) {
      const float r = radius[i];
      if (!(depth[i] > 0 && u[i] + r >= 0 && v[i] + r >= 0 && u[i] - r < num_columns &&
            v[i] - r < num_rows)) {
        continue;
      }
      DrawDisc(u[i], v[i], r, depth[i]);
      if (u[i] >= 0 && v[i] >= 0 && u[i] <= width && v[i] <= height) {
        const int column = std::min(columns_ - 1, static_cast<int>(u[i]));
        const int row = std::min(rows_ - 1, static_cast<int>(v[i]));
        in_frame->push_back({static_cast<uint32_t>(begin + i),
                             static_cast<uint32_t>(row * columns_ + column), depth[i]});
      }
    }
  }
}

std::vector<DepthGrid::InFrame> DepthGrid::Draw(const SurfelBlocks& surfels) {
  std::vector<InFrame> all;
  for (const SurfelBlocks::Block& block : surfels.blocks()) {
    if (block.positions.empty() || !MayMeet(block.middle, block.radius)) continue;
    const Positions positions(block.positions.front().data(), 3,
                              static_cast<Eigen::Index>(block.positions.size()));
    const size_t begin = all.size();
    Draw(positions, &all);
    for (size_t i = begin; i < all.size(); ++i) all[i].index = block.surfels[all[i].index];
  }
  return all;
}

// By its distance from each side of the frame's pyramid.
bool DepthGrid::MayMeet(const Eigen::Vector3d& middle, double radius) const {
  const Eigen::Vector3d in_camera = rotation_ * middle + translation_;
  const double margin = radius + surfel_width_;
  if (!(in_camera.z() > -margin)) return false;
  return std::all_of(sides_.begin(), sides_.end(),
                     [&](const Eigen::Vector3d& side) { return side.dot(in_camera) <= margin; });
}

bool DepthGrid::Meets(const Eigen::Vector3f& position) const {
  const Eigen::Vector3d in_camera = rotation_ * position.cast<double>() + translation_;
  if (!(in_camera.z() > 0)) return false;
  // Rounding of what Draw computes must not matter.
  const double margin = 0.5 * surfel_width_ * camera_.FocalPx() / in_camera.z() + 0.01 * square_px_;
  const double u = camera_.fx_px * in_camera.x() / in_camera.z() + camera_.cx_px;
  const double v = camera_.fy_px * in_camera.y() / in_camera.z() + camera_.cy_px;
  return u + margin >= 0 && v + margin >= 0 && u - margin < columns_ * square_px_ &&
         v - margin < rows_ * square_px_;
}

DepthGrid::Sight DepthGrid::Look(const Eigen::Vector3d& xyz, double tolerance) const {
  const Eigen::Vector3d in_camera = rotation_ * xyz + translation_;
  Eigen::Vector2d pixel;
  if (!camera_.Project(in_camera, &pixel)) return Sight::kOutside;
  const int column = std::min(columns_ - 1, static_cast<int>(pixel.x() / square_px_));
  const int row = std::min(rows_ - 1, static_cast<int>(pixel.y() / square_px_));
  const size_t square = static_cast<size_t>(row) * columns_ + column;
  return IsInFront(in_camera.z(), square, tolerance) ? Sight::kSeen : Sight::kHidden;
}

}  // namespace skein
