#include "benchmark/support/volume_over_plane.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/statistics.h"

namespace skein {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

constexpr size_t kPointsOfCell = 8;
constexpr double kThinnestArea =
    1e-9;  // of corners on a line, over the squared perimeter: rounding
constexpr double kNoHeight = std::numeric_limits<double>::quiet_NaN();

// Axes u, v in a plane, and the height over it.
struct PlaneFrame {
  Vector3d origin;
  Eigen::Matrix3d axes;  // a row each

  PlaneFrame(const Vector3d& at, const Vector3d& normal) : origin(at) {
    axes.row(2) = normal;
    axes.row(0) = normal.unitOrthogonal();
    axes.row(1) = axes.row(2).cross(axes.row(0));
  }
  Points In(Points points) const {
    for (Vector3d& p : points) p = axes * (p - origin);
    return points;
  }
};

// With Newell's normal.
std::optional<PlaneFrame> FrameOfCorners(const Points& corners, const Vector3d& up) {
  Vector3d sum = Vector3d::Zero(), twice_area = Vector3d::Zero();
  double perimeter = 0;
  for (size_t i = 0; i < corners.size(); ++i) {
    const Vector3d& next = corners[(i + 1) % corners.size()];
    sum += corners[i];
    twice_area += (corners[i] - corners[0]).cross(next - corners[0]);
    perimeter += (next - corners[i]).norm();
  }
  if (!(twice_area.norm() > kThinnestArea * perimeter * perimeter)) return std::nullopt;
  const double side = twice_area.dot(up) < 0 ? -1 : 1;
  return PlaneFrame(sum / static_cast<double>(corners.size()), side * twice_area.normalized());
}

// A polygon in a frame's plane; heights do not matter.
class Outline {
 public:
  explicit Outline(Points corners) : corners_(std::move(corners)) {
    for (const Vector3d& corner : corners_) box_.extend(corner.head<2>());
  }

  const Eigen::AlignedBox2d& box() const { return box_; }

  double Area() const {
    double twice = 0;
    ForEachEdge(
        [&](const Vector2d& a, const Vector2d& b) { twice += a.x() * b.y() - a.y() * b.x(); });
    return std::abs(twice) / 2;
  }

  // By the parity of the edges that a ray along u crosses.
  bool Contains(const Vector2d& p) const {
    bool inside = false;
    ForEachEdge([&](const Vector2d& a, const Vector2d& b) {
      if ((a.y() > p.y()) == (b.y() > p.y())) return;
      if (p.x() < a.x() + (p.y() - a.y()) * (b.x() - a.x()) / (b.y() - a.y())) inside = !inside;
    });
    return inside;
  }

  double DistanceFromEdges(const Vector2d& p) const {
    double nearest = std::numeric_limits<double>::infinity();
    ForEachEdge([&](const Vector2d& a, const Vector2d& b) {
      const double length2 = (b - a).squaredNorm();
      const double t = length2 > 0 ? std::clamp((p - a).dot(b - a) / length2, 0.0, 1.0) : 0.0;
      nearest = std::min(nearest, (p - a - t * (b - a)).norm());
    });
    return nearest;
  }

 private:
  template <typename Function>
  void ForEachEdge(const Function& function) const {
    for (size_t i = 0; i < corners_.size(); ++i) {
      function(corners_[i].head<2>(), corners_[(i + 1) % corners_.size()].head<2>());
    }
  }

  const Points corners_;
  Eigen::AlignedBox2d box_;
};

// Least squares of h = a u + b v + c. The corners make the solution unique.
PlaneFrame BaseFrame(const PlaneFrame& rough, const Points& corners, const Points& points,
                     double reach) {
  Eigen::Matrix3d normal_matrix = Eigen::Matrix3d::Zero();
  Vector3d right_side = Vector3d::Zero();
  const auto add = [&](const Vector3d& p) {
    const Vector3d row(p.x(), p.y(), 1);
    normal_matrix += row * row.transpose();
    right_side += p.z() * row;
  };
  const Outline outline(corners);
  for (const Vector3d& corner : corners) add(corner);
  for (const Vector3d& point : points) {
    if (outline.DistanceFromEdges(point.head<2>()) < reach) add(point);
  }
  const Vector3d abc = normal_matrix.ldlt().solve(right_side);
  const Vector3d normal = rough.axes.transpose() * Vector3d(-abc.x(), -abc.y(), 1).normalized();
  return {rough.origin + abc.z() * rough.axes.row(2).transpose(), normal};
}

// Square cells over an outline's box.
class HeightCells {
 public:
  HeightCells(const Outline& outline, double cell) : cell_(cell), low_(outline.box().min()) {
    const Vector2d size = outline.box().sizes() / cell;
    columns_ = 1 + static_cast<int>(size.x());
    rows_ = 1 + static_cast<int>(size.y());
    heights_.assign(static_cast<size_t>(columns_) * rows_, kNoHeight);
    for (int i = 0; i < static_cast<int>(heights_.size()); ++i) {
      if (outline.Contains(low_ + cell * Vector2d(i % columns_ + 0.5, i / columns_ + 0.5))) {
        inside_.push_back(i);
      }
    }
  }

  void SetHeights(const Points& points) {
    std::vector<std::vector<double>> of_cell(heights_.size());
    for (const Vector3d& p : points) {
      const Vector2d at = (p.head<2>() - low_) / cell_;
      if (!(at.x() >= 0 && at.y() >= 0 && at.x() < columns_ && at.y() < rows_)) continue;
      of_cell[static_cast<int>(at.y()) * columns_ + static_cast<int>(at.x())].push_back(p.z());
    }
    for (size_t i = 0; i < of_cell.size(); ++i) {
      if (!of_cell[i].empty()) heights_[i] = percentile(std::move(of_cell[i]), 50);
    }
  }

  // Returns how many cells inside were empty.
  size_t FillHoles() {
    std::vector<int> holes = HolesOf(inside_);
    const size_t num_holes = holes.size();
    for (size_t before = num_holes + 1; !holes.empty() && holes.size() < before;) {
      before = holes.size();
      std::vector<double> means;
      for (const int i : holes) means.push_back(MeanAround(i));
      for (size_t k = 0; k < holes.size(); ++k) heights_[holes[k]] = means[k];
      holes = HolesOf(holes);
    }
    return num_holes;
  }

  PlaneVolume Sum() const {
    PlaneVolume volume;
    const double area = cell_ * cell_;
    volume.cell = cell_;
    volume.area = area * static_cast<double>(inside_.size());
    for (const int i : inside_) {
      if (heights_[i] > 0) volume.above += area * heights_[i];
      if (heights_[i] < 0) volume.below -= area * heights_[i];
    }
    return volume;
  }

 private:
  std::vector<int> HolesOf(const std::vector<int>& cells) const {
    std::vector<int> holes;
    for (const int i : cells) {
      if (std::isnan(heights_[i])) holes.push_back(i);
    }
    return holes;
  }

  double MeanAround(int i) const {
    const int column = i % columns_, row = i / columns_;
    double sum = 0;
    int count = 0;
    for (int y = std::max(0, row - 1); y <= std::min(rows_ - 1, row + 1); ++y) {
      for (int x = std::max(0, column - 1); x <= std::min(columns_ - 1, column + 1); ++x) {
        const double height = heights_[y * columns_ + x];
        if (std::isnan(height)) continue;
        sum += height;
        ++count;
      }
    }
    return count > 0 ? sum / count : kNoHeight;
  }

  const double cell_;
  const Vector2d low_;
  int columns_ = 0, rows_ = 0;
  std::vector<double> heights_;
  std::vector<int> inside_;
};

}  // namespace

std::optional<PlaneVolume> VolumeOverPlane(const Points& points, const Points& corners,
                                           const Vector3d& up) {
  if (corners.size() < 3) return std::nullopt;
  const auto rough = FrameOfCorners(corners, up);
  if (!rough) return std::nullopt;
  const Points seen = rough->In(points), rough_corners = rough->In(corners);
  const Outline outline(rough_corners);
  const size_t num_inside = std::count_if(seen.begin(), seen.end(), [&](const Vector3d& p) {
    return outline.box().contains(p.head<2>()) && outline.Contains(p.head<2>());
  });
  if (num_inside < kPointsOfCell) return std::nullopt;
  const double cell = std::sqrt(outline.Area() * kPointsOfCell / static_cast<double>(num_inside));
  const PlaneFrame base = BaseFrame(*rough, rough_corners, seen, cell);
  HeightCells cells(Outline(base.In(corners)), cell);
  cells.SetHeights(base.In(points));
  const size_t num_holes = cells.FillHoles();
  PlaneVolume volume = cells.Sum();
  if (!(volume.area > 0)) return std::nullopt;
  volume.filled = static_cast<double>(num_holes) * cell * cell / volume.area;
  return volume;
}

}  // namespace skein
