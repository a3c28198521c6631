#include "depth/neighbours.h"

#include <algorithm>
#include <cmath>

#include "core/angles.h"

namespace skein {
namespace {

constexpr double kMinAngle = 1, kGoodAngle = 5, kLastGoodAngle = 25, kMaxAngle = 45;  // degrees
constexpr double kSamePlaceAngle = 2;                                                 // degrees
constexpr size_t kMinPoints = 8;
constexpr double kOutliers = 0.01;  // part of the points, at each end
constexpr double kMargin = 0.15;    // of the range of inverse depth, at each end

double AngleDeg(const Eigen::Vector3d& point, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d u = a - point, v = b - point;
  return RadToDeg(std::atan2(u.cross(v).norm(), u.dot(v)));
}

double WeightOfAngle(double degrees) {
  const double rise = (degrees - kMinAngle) / (kGoodAngle - kMinAngle);
  const double fall = (kMaxAngle - degrees) / (kMaxAngle - kLastGoodAngle);
  return std::clamp(std::min(rise, fall), 0.0, 1.0);
}

struct Candidate {
  int photo;
  double score;
  Eigen::Vector3d middle;  // of the common points
};

Candidate Rate(const std::vector<SparsePhoto>& photos, const std::vector<Eigen::Vector3d>& points,
               int index, int other) {
  std::vector<int> common;
  std::set_intersection(photos[index].points.begin(), photos[index].points.end(),
                        photos[other].points.begin(), photos[other].points.end(),
                        std::back_inserter(common));
  Candidate candidate{other, 0, Eigen::Vector3d::Zero()};
  const Eigen::Vector3d a = photos[index].cam_from_world.Centre(),
                        b = photos[other].cam_from_world.Centre();
  for (const int i : common) {
    candidate.score += WeightOfAngle(AngleDeg(points[i], a, b));
    candidate.middle += points[i] / static_cast<double>(common.size());
  }
  return candidate;
}

}  // namespace

std::vector<int> ChooseNeighbours(const std::vector<SparsePhoto>& photos,
                                  const std::vector<Eigen::Vector3d>& points, int index,
                                  size_t most) {
  std::vector<Candidate> candidates;
  for (int other = 0; other < static_cast<int>(photos.size()); ++other) {
    if (other == index) continue;
    const Candidate candidate = Rate(photos, points, index, other);
    if (candidate.score >= kMinCommon) candidates.push_back(candidate);
  }
  std::vector<int> chosen;
  while (chosen.size() < most && !candidates.empty()) {
    const auto best =
        std::max_element(candidates.begin(), candidates.end(),
                         [](const Candidate& a, const Candidate& b) { return a.score < b.score; });
    const Eigen::Vector3d place = photos[best->photo].cam_from_world.Centre();
    chosen.push_back(best->photo);
    candidates.erase(best);
    for (Candidate& other : candidates) {
      const Eigen::Vector3d there = photos[other.photo].cam_from_world.Centre();
      if (AngleDeg(other.middle, place, there) < kSamePlaceAngle) other.score /= 2;
    }
  }
  return chosen;
}

std::vector<double> DepthsOfPoints(const SparsePhoto& photo,
                                   const std::vector<Eigen::Vector3d>& points) {
  std::vector<double> depths;
  for (const int i : photo.points) {
    const double depth =
        photo.cam_from_world.rotation.row(2) * points[i] + photo.cam_from_world.translation.z();
    if (depth > 0 && std::isfinite(depth)) depths.push_back(depth);
  }
  return depths;
}

std::optional<DepthRange> RangeOfPoints(const SparsePhoto& photo,
                                        const std::vector<Eigen::Vector3d>& points) {
  std::vector<double> inverse = DepthsOfPoints(photo, points);
  for (double& value : inverse) value = 1 / value;
  if (inverse.size() < kMinPoints) return std::nullopt;
  std::sort(inverse.begin(), inverse.end());
  const size_t outliers = static_cast<size_t>(kOutliers * static_cast<double>(inverse.size()));
  const double low = inverse[outliers], high = inverse[inverse.size() - 1 - outliers];
  const double margin = kMargin * std::max(high - low, 0.1 * high);
  return DepthRange{1 / (high + margin), 1 / std::max(low - margin, 0.5 * low)};
}

}  // namespace skein
