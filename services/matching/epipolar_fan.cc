#include "matching/epipolar_fan.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace skein {
namespace {

// Epipoles farther away count as at this distance: over a photo the lines turn by less than 1e-3
// px.
constexpr double kMaxEpipolePx = 1e10;

// From a far epipole the direction of a line counts by where the line passes the photo's middle: by
// its slope it would be lost in rounding, or lead to where the epipole was before it was limited.
constexpr double kFarEpipolePx = 1e5;
constexpr double kFirstRingPx = 16;
constexpr int kMaxRings = 32;

// Of the lines' normals, the rows' largest cross product: x2^T F = 0 there.
Eigen::Vector2d LeftEpipole(const Eigen::Matrix3d& F) {
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  for (const auto& [a, b] : {std::pair(0, 1), std::pair(0, 2), std::pair(1, 2)}) {
    const Eigen::Vector3d cross = F.col(a).normalized().cross(F.col(b).normalized());
    if (cross.squaredNorm() > best.squaredNorm()) best = cross;
  }
  const double scale = std::abs(best.z()) * kMaxEpipolePx < best.head<2>().norm()
                           ? std::copysign(best.head<2>().norm() / kMaxEpipolePx, best.z())
                           : best.z();
  return best.head<2>() / (scale == 0 ? 1 : scale);
}

}  // namespace

double EpipolarFan::DirectionOf(double dx, double dy) const {
  double direction = std::atan2(dy, dx) - first_direction_;
  direction -= M_PI * std::floor(direction / M_PI);
  return direction;
}

double EpipolarFan::DirectionOf(const Eigen::Vector3d& line) const {
  if ((middle_ - epipole_).norm() < kFarEpipolePx) return DirectionOf(line.y(), -line.x());
  const Eigen::Vector2d normal = line.head<2>();
  const Eigen::Vector2d foot =
      middle_ - normal * (line.dot(middle_.homogeneous()) / normal.squaredNorm());
  return DirectionOf(foot.x() - epipole_.x(), foot.y() - epipole_.y());
}

void EpipolarFan::Build(const std::vector<Eigen::Vector2d>& points2, const Eigen::Matrix3d& F) {
  F_ = F / F.norm();
  epipole_ = LeftEpipole(F_);
  // The fan's middle lies in the middle of 0 to pi, so that it seldom wraps around.
  middle_.setZero();
  for (const auto& point : points2) middle_ += point / static_cast<double>(points2.size());
  first_direction_ = std::atan2(middle_.y() - epipole_.y(), middle_.x() - epipole_.x()) - M_PI / 2;

  struct Entry {
    int ring;
    uint32_t feature;
    double direction, distance_px;
  };
  std::vector<Entry> entries(points2.size());
  for (size_t i = 0; i < points2.size(); ++i) {
    const Eigen::Vector2d d = points2[i] - epipole_;
    const double distance_px = d.norm();
    const int ring =
        std::clamp(std::ilogb(std::max(1.0, distance_px / kFirstRingPx)), 0, kMaxRings - 1) +
        (distance_px >= kFirstRingPx);
    entries[i] = {ring, static_cast<uint32_t>(i), DirectionOf(d.x(), d.y()), distance_px};
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.ring != b.ring ? a.ring < b.ring : a.direction < b.direction;
  });
  rings_.clear();
  for (auto* values : {&x_, &y_, &back_gradient_sq_}) values->resize(points2.size());
  directions_.resize(points2.size());
  features_.resize(points2.size());
  for (uint32_t at = 0; at < entries.size(); ++at) {
    const Entry& entry = entries[at];
    const Eigen::Vector2d& point = points2[entry.feature];
    const double back_sq = (F_.transpose() * point.homogeneous()).head<2>().squaredNorm();
    if (at == 0 || entry.ring != entries[at - 1].ring) {
      rings_.push_back({at, at, entry.distance_px, 0});
    }
    Ring& ring = rings_.back();
    ring.end = at + 1;
    ring.min_distance_px = std::min(ring.min_distance_px, entry.distance_px);
    ring.max_back_gradient_sq = std::max(ring.max_back_gradient_sq, back_sq);
    directions_[at] = entry.direction;
    features_[at] = entry.feature;
    x_[at] = static_cast<float>(point.x());
    y_[at] = static_cast<float>(point.y());
    back_gradient_sq_[at] = static_cast<float>(back_sq);
  }
}

// The Sampson error is (l . x)^2 / (|l|^2 + |l'|^2), with the first two coordinates of l and l'.
void EpipolarFan::FindInRange(const Ring& ring, double low, double high,
                              const Eigen::Vector3f& line, float max_error_sq,
                              std::vector<uint32_t>* places) const {
  const auto first = directions_.begin() + ring.begin, last = directions_.begin() + ring.end;
  const auto begin = std::lower_bound(first, last, low) - directions_.begin();
  const auto end = std::upper_bound(directions_.begin() + begin, last, high) - directions_.begin();
  constexpr int kChunk = 64;
  float excess[kChunk];
  const float l0 = line[0], l1 = line[1], l2 = line[2], gradient_sq = l0 * l0 + l1 * l1;
  for (auto at = begin; at < end; at += kChunk) {
    const int count = static_cast<int>(std::min<std::ptrdiff_t>(kChunk, end - at));
    const float *x = x_.data() + at, *y = y_.data() + at, *back = back_gradient_sq_.data() + at;
    for (int i = 0; i < count; ++i) {
      const float c = l0 * x[i] + l1 * y[i] + l2;
      excess[i] = c * c - max_error_sq * (gradient_sq + back[i]);
    }
    const size_t size = places->size();
    places->resize(size + count);
    uint32_t* out = places->data() + size;
    for (int i = 0; i < count; ++i) {
      *out = static_cast<uint32_t>(at + i);
      out += excess[i] <= 0;
    }
    places->resize(out - places->data());
  }
}

void EpipolarFan::Find(const Eigen::Vector2d& x1, double max_error_px,
                       std::vector<uint32_t>* places) const {
  const Eigen::Vector3d line = F_ * x1.homogeneous();
  const double gradient_sq = line.head<2>().squaredNorm();
  if (!(gradient_sq > 0)) return;
  const double direction = DirectionOf(line);
  const auto max_error_sq = static_cast<float>(max_error_px * max_error_px);
  for (const Ring& ring : rings_) {
    const double distance_px =
        max_error_px * std::sqrt(1 + ring.max_back_gradient_sq / gradient_sq) * 1.001;
    const auto find = [&](double low, double high) {
      FindInRange(ring, low, high, line.cast<float>(), max_error_sq, places);
    };
    if (distance_px >= ring.min_distance_px) {
      find(0, M_PI);
      continue;
    }
    const double angle = std::asin(distance_px / ring.min_distance_px);
    const double low = direction - angle, high = direction + angle;
    if (high - low >= M_PI) {
      find(0, M_PI);
      continue;
    }
    find(std::max(0.0, low), std::min(M_PI, high));
    if (low < 0) find(low + M_PI, M_PI);
    if (high > M_PI) find(0, high - M_PI);
  }
}

}  // namespace skein
