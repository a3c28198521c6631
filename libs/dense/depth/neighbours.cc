#include "depth/neighbours.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/angles.h"
#include "depth/inverse_planes.h"

namespace skein {
namespace {

constexpr double kMinAngle = 1, kGoodAngle = 5, kLastGoodAngle = 25, kMaxAngle = 45;  // degrees
constexpr double kSamePlaceAngle = 2;                                                 // degrees
constexpr size_t kMinPoints = 8;
constexpr double kOutliers = 0.01;  // part of the points, at each end
constexpr double kMargin = 0.15;    // of the range of inverse depth, at each end
// A plane of points: the part of the range of inverse depth by which a point may be off it, the
// part of the points that lie on it, and the triples that are tried for it.
constexpr double kOffPlane = 0.004, kMinOnPlane = 0.05;
constexpr int kPlaneTriples = 1000;

double AngleDeg(const Eigen::Vector3d& point, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d u = a - point, v = b - point;
  return RadToDeg(std::atan2(u.cross(v).norm(), u.dot(v)));
}

double WeightOfAngle(double degrees) {
  const double rise = (degrees - kMinAngle) / (kGoodAngle - kMinAngle);
  const double fall = (kMaxAngle - degrees) / (kMaxAngle - kLastGoodAngle);
  return std::clamp(std::min(rise, fall), 0.0, 1.0);
}

// A common point, as index into the points of the photo whose neighbours are chosen.
struct CommonPoint {
  size_t point;
  double weight;
};

struct Candidate {
  int photo;
  double score = 0;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  // of the common points
  std::vector<CommonPoint> common = {};
  double part = 1;  // of the score that counts, by the places of those chosen before
};

Candidate Rate(const std::vector<SparsePhoto>& photos, const std::vector<Eigen::Vector3d>& points,
               int index, int other) {
  Candidate candidate{other};
  const Eigen::Vector3d a = photos[index].cam_from_world.Centre(),
                        b = photos[other].cam_from_world.Centre();
  const std::vector<int>&mine = photos[index].points, &theirs = photos[other].points;
  for (size_t i = 0, k = 0; i < mine.size(); ++i) {
    while (k < theirs.size() && theirs[k] < mine[i]) ++k;
    if (k == theirs.size()) break;
    if (theirs[k] != mine[i]) continue;
    candidate.common.push_back({i, WeightOfAngle(AngleDeg(points[mine[i]], a, b))});
    candidate.score += candidate.common.back().weight;
    candidate.middle += points[mine[i]];
  }
  candidate.middle /= static_cast<double>(std::max<size_t>(1, candidate.common.size()));
  return candidate;
}

// `left`: of each point, the part that the chosen ones leave.
double Gain(const Candidate& candidate, const std::vector<double>& left) {
  double sum = 0;
  for (const CommonPoint& common : candidate.common) sum += common.weight * left[common.point];
  return candidate.part * sum;
}

// In front of the camera.
std::vector<InverseDepth> InverseDepthsOf(const SparsePhoto& photo,
                                          const std::vector<Eigen::Vector3d>& points) {
  const DepthPose& pose = photo.cam_from_world;
  std::vector<InverseDepth> depths;
  for (const int i : photo.points) {
    const Eigen::Vector3d point = pose.ToCamera(points[i]);
    if (!(point.z() > 0 && point.allFinite())) continue;
    depths.push_back({point.hnormalized(), 1 / point.z()});
  }
  return depths;
}

std::vector<Eigen::Vector3d> PlanesOf(const std::vector<InverseDepth>& depths, double range) {
  std::vector<Eigen::Vector3d> planes;
  const PlaneSearch search{kOffPlane * range, kMinOnPlane, kMinOnPlane, kPlaneTriples};
  for (const FoundPlane& found : FindPlanes(depths, search).planes) planes.push_back(found.plane);
  return planes;
}

}  // namespace

std::vector<int> ChooseNeighbours(const std::vector<SparsePhoto>& photos,
                                  const std::vector<Eigen::Vector3d>& points, int index,
                                  size_t most) {
  std::vector<Candidate> candidates;
  for (int other = 0; other < static_cast<int>(photos.size()); ++other) {
    if (other == index) continue;
    Candidate candidate = Rate(photos, points, index, other);
    if (candidate.score >= kMinCommon) candidates.push_back(std::move(candidate));
  }
  std::vector<double> left(photos[index].points.size(), 1);
  std::vector<int> chosen;
  while (chosen.size() < most && !candidates.empty()) {
    for (Candidate& candidate : candidates) candidate.score = Gain(candidate, left);
    const auto best =
        std::max_element(candidates.begin(), candidates.end(),
                         [](const Candidate& a, const Candidate& b) { return a.score < b.score; });
    const Eigen::Vector3d place = photos[best->photo].cam_from_world.Centre();
    chosen.push_back(best->photo);
    for (const CommonPoint& common : best->common) left[common.point] *= 1 - common.weight / 2;
    candidates.erase(best);
    for (Candidate& other : candidates) {
      const Eigen::Vector3d there = photos[other.photo].cam_from_world.Centre();
      if (AngleDeg(other.middle, place, there) < kSamePlaceAngle) other.part /= 2;
    }
  }
  return chosen;
}

std::vector<double> DepthsOfPoints(const SparsePhoto& photo,
                                   const std::vector<Eigen::Vector3d>& points) {
  std::vector<double> depths;
  for (const InverseDepth& one : InverseDepthsOf(photo, points)) depths.push_back(1 / one.inverse);
  return depths;
}

std::optional<DepthRange> RangeOfPoints(const SparsePhoto& photo,
                                        const std::vector<Eigen::Vector3d>& points) {
  const std::vector<InverseDepth> depths = InverseDepthsOf(photo, points);
  if (depths.size() < kMinPoints) return std::nullopt;
  std::vector<double> inverse;
  for (const InverseDepth& one : depths) inverse.push_back(one.inverse);
  std::sort(inverse.begin(), inverse.end());
  const size_t outliers = static_cast<size_t>(kOutliers * static_cast<double>(inverse.size()));
  const double low = inverse[outliers], high = inverse[inverse.size() - 1 - outliers];
  const double margin = kMargin * std::max(high - low, 0.1 * high);
  const double first = std::max(low - margin, 0.5 * low), last = high + margin;
  return DepthRange{1 / last, 1 / first, PlanesOf(depths, last - first)};
}

}  // namespace skein
