#include "guidance/holes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace skein {
namespace {

constexpr int kColumns = 10;

// Which squares of a photo have points.
class Squares {
 public:
  explicit Squares(const GuidedCamera& camera)
      : camera_(camera),
        rows_(std::max(1, static_cast<int>(std::lround(static_cast<double>(kColumns) *
                                                       camera.height_px / camera.width_px)))),
        has_points_(static_cast<size_t>(kColumns) * rows_, false) {}

  void Add(const Eigen::Vector3d& in_camera) {
    Eigen::Vector2d pixel;
    if (!camera_.Project(in_camera, &pixel)) return;
    const int column = static_cast<int>(pixel.x() * kColumns / camera_.width_px);
    const int row = static_cast<int>(pixel.y() * rows_ / camera_.height_px);
    has_points_[Index(std::min(column, kColumns - 1), std::min(row, rows_ - 1))] = true;
  }

  int NumWithPoints() const {
    return static_cast<int>(std::count(has_points_.begin(), has_points_.end(), true));
  }
  int NumHoles(const std::array<int, 2>& upwards) const {
    int holes = 0;
    for (int row = 0; row < rows_; ++row) {
      for (int column = 0; column < kColumns; ++column)
        holes += IsHole(column, row, {upwards[0], upwards[1]});
    }
    return holes;
  }

 private:
  struct Step {
    int column, row;
  };

  size_t Index(int column, int row) const { return static_cast<size_t>(row) * kColumns + column; }
  bool AnyTowards(int column, int row, Step step) const {
    while (true) {
      column += step.column;
      row += step.row;
      if (column < 0 || row < 0 || column >= kColumns || row >= rows_) return false;
      if (has_points_[Index(column, row)]) return true;
    }
  }
  bool IsHole(int column, int row, Step up) const {
    if (has_points_[Index(column, row)] || !AnyTowards(column, row, up)) return false;
    return AnyTowards(column, row, {-up.column, -up.row}) +
               AnyTowards(column, row, {up.row, up.column}) +
               AnyTowards(column, row, {-up.row, -up.column}) >=
           2;
  }

  const GuidedCamera& camera_;
  const int rows_;
  std::vector<bool> has_points_;
};

// up: in the camera's frame.
std::array<int, 2> UpwardsOf(const Eigen::Vector3d& up) {
  if (std::abs(up.x()) > std::abs(up.y())) return {up.x() > 0 ? 1 : -1, 0};
  return {0, up.y() > 0 ? 1 : -1};
}

}  // namespace

double Holes::Update(const GuidedMap& map, const std::vector<bool>& changed) {
  const Eigen::Vector3d up = UpOf(map);
  photos_.resize(map.photos.size());
  std::vector<Squares> squares;
  std::vector<char> stale(changed.begin(), changed.end());
  for (size_t i = 0; i < photos_.size(); ++i) {
    const GuidedPhoto& photo = map.photos[i];
    squares.emplace_back(map.cameras[photo.camera]);
    const std::array<int, 2> upwards = UpwardsOf(photo.cam_from_world.rotation * up);
    if (std::exchange(photos_[i].upwards, upwards) != upwards) stale[i] = true;
  }
  for (const GuidedPoint& point : map.points) {
    for (const uint32_t photo : point.photos) {
      if (stale[photo]) squares[photo].Add(map.photos[photo].cam_from_world.Apply(point.xyz));
    }
  }
  int known = 0, holes = 0;
  for (size_t i = 0; i < photos_.size(); ++i) {
    OfPhoto& photo = photos_[i];
    if (stale[i]) {
      photo.num_with_points = squares[i].NumWithPoints();
      photo.num_holes = squares[i].NumHoles(photo.upwards);
    }
    known += photo.num_with_points;
    holes += photo.num_holes;
  }
  return static_cast<double>(holes) / std::max(1, known + holes);
}

}  // namespace skein
