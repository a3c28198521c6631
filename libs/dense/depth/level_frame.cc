#include "depth/level_frame.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <random>
#include <utility>

#include "core/angles.h"
#include "core/statistics.h"

namespace skein {
namespace {

using Plane = Eigen::Hyperplane<double, 3>;
using PlanePoints = std::vector<Eigen::Vector3d>;
using Eigen::Matrix3d;
using Eigen::Vector3d;

// UpOfCameras, as in web/src/frames.js.
constexpr double kCentresWeight = 0.3, kTopsWeight = 0.15, kViewsWeight = 0.5;
constexpr size_t kCentresOfPlane = 3;

constexpr double kGroundFlatness = 0.02;  // of the median distance from the median point
constexpr double kLeastGround = 0.2;      // share of the points
constexpr double kMostTiltDeg = 30;
// A plane that holds kLeastGround is met with a probability of 1 - (1 - 0.2^3)^1000 = 0.9997.
constexpr int kPlaneTrials = 1000;
constexpr int kPlaneFits = 3;  // by least squares
constexpr size_t kMostLevelPoints = 20'000;

Vector3d MeanOf(const PlanePoints& points) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

Matrix3d ScatterOf(const PlanePoints& points) {
  const Vector3d mean = MeanOf(points);
  Matrix3d scatter = Matrix3d::Zero();
  for (const Vector3d& point : points) scatter += (point - mean) * (point - mean).transpose();
  return scatter;
}

// Column 0 is of the smallest eigenvalue.
Matrix3d AxesOf(const Matrix3d& symmetric) {
  return Eigen::SelfAdjointEigenSolver<Matrix3d>(symmetric).eigenvectors();
}

PlanePoints CentresOf(const std::vector<DepthPose>& cameras) {
  PlanePoints centres;
  for (const DepthPose& camera : cameras) centres.push_back(camera.Centre());
  return centres;
}

// Mean of an axis of the cameras, in the world.
Vector3d MeanAxis(const std::vector<DepthPose>& cameras, int axis) {
  Vector3d sum = Vector3d::Zero();
  for (const DepthPose& camera : cameras) sum += camera.rotation.row(axis).transpose();
  return sum / static_cast<double>(std::max<size_t>(1, cameras.size()));
}

PlanePoints Evenly(const std::vector<ColouredMap>& maps) {
  size_t num_points = 0, index = 0;
  for (const ColouredMap& map : maps) num_points += map.points->size();
  const size_t step = 1 + num_points / kMostLevelPoints;
  PlanePoints chosen;
  for (const ColouredMap& map : maps) {
    for (const DensePoint& point : *map.points) {
      if (index++ % step == 0) chosen.push_back(point.position);
    }
  }
  return chosen;
}

Vector3d MedianOf(const PlanePoints& points) {
  Vector3d median;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Vector3d& point : points) values.push_back(point[axis]);
    median[axis] = UpperMedian(std::move(values));
  }
  return median;
}

double MedianDistance(const PlanePoints& points, const Vector3d& from) {
  std::vector<double> distances;
  for (const Vector3d& point : points) distances.push_back((point - from).norm());
  return UpperMedian(std::move(distances));
}

// Searches the plane in which most points lie.
class GroundSearch {
 public:
  // tolerance: greatest distance from the plane.
  GroundSearch(const PlanePoints& points, const Vector3d& up, double tolerance)
      : points_(points), up_(up), tolerance_(tolerance) {}

  // The points of the ground plane; empty without one.
  PlanePoints Find() {
    if (points_.size() < 3) return {};
    for (int trial = 0; trial < kPlaneTrials; ++trial) Try(Sample());
    for (int fit = 0; fit < kPlaneFits && num_best_ > 0; ++fit) Try(FitOf(Near(best_)));
    const bool is_ground = num_best_ >= kLeastGround * static_cast<double>(points_.size());
    return is_ground ? Near(best_) : PlanePoints{};
  }

  static Plane FitOf(const PlanePoints& points) {
    return {Vector3d(AxesOf(ScatterOf(points)).col(0)), MeanOf(points)};
  }

 private:
  const Vector3d& Draw() { return points_[random_() % points_.size()]; }

  Plane Sample() {
    const Vector3d a = Draw(), b = Draw(), c = Draw();
    return Plane::Through(a, b, c);
  }

  bool IsNear(const Plane& plane, const Vector3d& point) const {
    return plane.absDistance(point) <= tolerance_;
  }

  void Try(const Plane& plane) {
    const double level = std::abs(plane.normal().dot(up_));
    if (!(level >= std::cos(DegToRad(kMostTiltDeg)))) return;
    const auto count = std::count_if(points_.begin(), points_.end(),
                                     [&](const Vector3d& point) { return IsNear(plane, point); });
    if (count <= num_best_) return;
    num_best_ = count;
    best_ = plane;
  }

  PlanePoints Near(const Plane& plane) const {
    PlanePoints near;
    std::copy_if(points_.begin(), points_.end(), std::back_inserter(near),
                 [&](const Vector3d& point) { return IsNear(plane, point); });
    return near;
  }

  const PlanePoints& points_;
  const Vector3d up_;
  const double tolerance_;
  std::mt19937_64 random_{1};
  Plane best_{Vector3d::UnitZ(), 0};
  ptrdiff_t num_best_ = 0;
};

// Unit, level: along the longer extent of the points.
Vector3d Along(const PlanePoints& points, const Vector3d& up) {
  const Matrix3d flat = Matrix3d::Identity() - up * up.transpose();
  if (points.size() < 3) return up.unitOrthogonal();
  const Vector3d along = flat * AxesOf(flat * ScatterOf(points) * flat).col(2);
  return along.norm() > 0.5 ? along.normalized() : up.unitOrthogonal();
}

// Rows: right, ahead, up. `heading`: points ahead rather than back.
Matrix3d LevelAxes(const Vector3d& right, const Vector3d& up, const Vector3d& heading) {
  const Vector3d ahead = up.cross(right);
  const double sign = ahead.dot(heading) < 0 ? -1 : 1;
  Matrix3d axes;
  axes << sign * right.transpose(), sign * ahead.transpose(), up.transpose();
  return axes;
}

}  // namespace

Vector3d UpOfCameras(const std::vector<DepthPose>& cameras) {
  if (cameras.empty()) return Vector3d::UnitZ();
  Matrix3d cost = Matrix3d::Zero();
  for (const DepthPose& camera : cameras) {
    cost += camera.rotation.row(0).transpose() * camera.rotation.row(0) /
            static_cast<double>(cameras.size());
  }
  const Matrix3d spread = ScatterOf(CentresOf(cameras));
  const bool has_plane = cameras.size() >= kCentresOfPlane && spread.trace() > 0;
  if (has_plane) cost += kCentresWeight / spread.trace() * spread;
  const Vector3d top = -MeanAxis(cameras, 1);
  cost -= kTopsWeight * top * top.transpose();
  const Vector3d up = AxesOf(cost).col(0);
  const double sign = up.dot(top - kViewsWeight * MeanAxis(cameras, 2));
  return sign < 0 ? Vector3d(-up) : up;
}

LevelFrame LevelFrameOf(const std::vector<DepthPose>& cameras, const PlanePoints& points) {
  LevelFrame frame;
  if (points.empty()) return frame;
  Vector3d up = UpOfCameras(cameras), middle = MedianOf(points);
  const double tolerance = kGroundFlatness * MedianDistance(points, middle);
  const PlanePoints ground = GroundSearch(points, up, tolerance).Find();
  if (!ground.empty()) {
    const Plane plane = GroundSearch::FitOf(ground);
    up = plane.normal().dot(up) < 0 ? Vector3d(-plane.normal()) : plane.normal();
    middle = plane.projection(middle);
    frame.ground_share = static_cast<double>(ground.size()) / static_cast<double>(points.size());
  }
  const Vector3d heading = MeanAxis(cameras, 2) - MeanAxis(cameras, 1);
  const Matrix3d axes = LevelAxes(Along(ground.empty() ? points : ground, up), up, heading);
  frame.level_from_model.linear() = axes;
  frame.level_from_model.translation() = -axes * middle;
  return frame;
}

LevelFrame LevelFrameOf(const std::vector<ColouredMap>& maps) {
  std::vector<DepthPose> cameras;
  for (const ColouredMap& map : maps) cameras.push_back(map.map->cam_from_world);
  return LevelFrameOf(cameras, Evenly(maps));
}

}  // namespace skein
