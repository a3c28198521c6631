#include "depth/consistency.h"

#include <cmath>

#include "core/option_check.h"

namespace skein {
namespace {

// The error of matching that neighbouring pixels and maps have in common: averaging leaves it.
constexpr double kCommonError = 0.2;  // of the errors of the maps

// A pixel and a depth of one map as another map's camera sees them. In pixels whose first centre is
// at (0, 0): then x + y + shift is (z u, z v, z) of the other camera.
struct Transfer {
  Eigen::Matrix3f of_pixel;  // times depth
  Eigen::Vector3f shift;

  Transfer(const DepthMap& from, const DepthMap& to) {
    const Eigen::Matrix3d rotation =
        to.cam_from_world.rotation * from.cam_from_world.rotation.transpose();
    const Eigen::Vector3d translation =
        to.cam_from_world.translation - rotation * from.cam_from_world.translation;
    const Eigen::Matrix3d k = Calibration(to.camera);
    of_pixel = (k * rotation * Calibration(from.camera).inverse()).cast<float>();
    shift = (k * translation).cast<float>();
  }

  static Eigen::Matrix3d Calibration(const DepthCamera& camera) {
    Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
    k.diagonal().head<2>() = camera.focal_px;
    k.topRightCorner<2, 1>() = camera.principal_point_px.array() - 0.5;
    return k;
  }

  Eigen::Vector3f Apply(float x, float y, float depth) const {
    return depth * (of_pixel * Eigen::Vector3f(x, y, 1)) + shift;
  }
};

struct Estimate {
  double depth, error;
};

class Agreement {
 public:
  Agreement(const AgreementOptions& options, const DepthMap& map, const DepthMap& other)
      : difference_(static_cast<float>(options.max_depth_difference)),
        distance_sq_(static_cast<float>(options.max_reprojection_px * options.max_reprojection_px)),
        other_(other),
        there_(map, other),
        back_(other, map) {}

  // False: the other map does not agree. Else what it says of the pixel.
  bool Find(int x, int y, float depth, Estimate* estimate) const {
    const float column = static_cast<float>(x), row = static_cast<float>(y);
    const Eigen::Vector3f there = there_.Apply(column, row, depth);
    if (!(there.z() > 0)) return false;
    const float u = there.x() / there.z(), v = there.y() / there.z();
    if (!(u > -0.5f && v > -0.5f)) return false;
    const int nearest_u = static_cast<int>(u + 0.5f), nearest_v = static_cast<int>(v + 0.5f);
    if (nearest_u >= other_.depth.cols || nearest_v >= other_.depth.rows) return false;
    const float other_depth = other_.depth(nearest_v, nearest_u);
    if (!(std::abs(other_depth - there.z()) <= difference_ * there.z())) return false;
    const Eigen::Vector3f back = back_.Apply(u, v, other_depth);
    const float du = back.x() - column * back.z(), dv = back.y() - row * back.z();
    if (!(back.z() > 0 && du * du + dv * dv <= distance_sq_ * back.z() * back.z())) return false;
    *estimate = {back.z(), other_.error(nearest_v, nearest_u) * back.z() / other_depth};
    return true;
  }

 private:
  const float difference_, distance_sq_;
  const DepthMap& other_;
  const Transfer there_, back_;
};

class Mean {
 public:
  void Add(const Estimate& estimate) {
    const double weight = 1 / (estimate.error * estimate.error);
    weight_ += weight;
    sum_ += weight * estimate.depth;
    squares_ += weight * estimate.depth * estimate.depth;
    ++count_;
  }
  int count() const { return count_; }
  double Value() const { return sum_ / weight_; }
  double Error() const {
    const double variance = std::max(0.0, squares_ / weight_ - Value() * Value());
    const double single = count_ / weight_;  // mean squared error of one
    const double common = kCommonError * kCommonError * single;
    return std::sqrt(common + std::max(single, variance) / count_);
  }

 private:
  double weight_ = 0, sum_ = 0, squares_ = 0;
  int count_ = 0;
};

}  // namespace

Status AgreementOptions::Check() const {
  return FirstError({InRange("min_agreeing", min_agreeing, 0, 100),
                     InRange("max_depth_difference", max_depth_difference, 0.0, 1.0),
                     InRange("max_reprojection_px", max_reprojection_px, 0.0, 100.0)});
}

DepthMap KeepAgreed(const AgreementOptions& options, const DepthMap& map,
                    const std::vector<const DepthMap*>& others) {
  ThrowUnlessSound(options.Check());
  DepthMap kept{map.camera, map.cam_from_world, cv::Mat1f(map.depth.size(), 0.0f),
                cv::Mat1f(map.depth.size(), 0.0f)};
  std::vector<Agreement> agreements;
  for (const DepthMap* other : others) agreements.emplace_back(options, map, *other);
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      const float depth = map.depth(y, x);
      if (!(depth > 0)) continue;
      Mean mean;
      mean.Add({depth, map.error(y, x)});
      Estimate estimate = {};
      for (const Agreement& agreement : agreements) {
        if (agreement.Find(x, y, depth, &estimate)) mean.Add(estimate);
      }
      if (mean.count() <= options.min_agreeing) continue;
      kept.depth(y, x) = static_cast<float>(mean.Value());
      kept.error(y, x) = static_cast<float>(mean.Error());
    }
  }
  return kept;
}

}  // namespace skein
