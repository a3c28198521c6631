// The photos of a surfel as it sees them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <limits>
#include <vector>

#include "guidance/quality.h"

namespace skein {

ViewOfSurfel ViewFrom(const Eigen::Vector3d& centre, double focal_px,
                      const Eigen::Vector3d& position);
std::vector<ViewOfSurfel> ViewsOf(const GuidedMap& map, const Surfel& surfel);

// What photos of a surfel are worth together, and what with one more.
class AssessedViews {
 public:
  AssessedViews() = default;
  AssessedViews(const QualityOptions& options, const Eigen::Vector3d& normal,
                const std::vector<ViewOfSurfel>& views);

  // As AssessSurfel of the views.
  SurfelQuality Quality(const QualityOptions& options) const;
  // As AssessSurfel of the views and this one. Costs 1/8 of it, or as much where there are more
  // than kMaxViews and this is among the best.
  SurfelQuality QualityWith(const QualityOptions& options, const ViewOfSurfel& view) const;

 private:
  // More photos of a surfel say little; the cost of pairs is quadratic.
  static constexpr size_t kMaxViews = 16;

  double RankOf(const ViewOfSurfel& view) const;
  void Count(const ViewOfSurfel& view);
  void AddPairs(const QualityOptions& options, const ViewOfSurfel& view);
  void Match(size_t i);

  Eigen::Vector3d normal_ = Eigen::Vector3d::Zero();
  int num_photos_ = 0;
  double best_gsd_ = std::numeric_limits<double>::infinity(), second_gsd_ = best_gsd_;
  // The best ones, at most kMaxViews, and what their pairs sum up to.
  size_t num_ = 0;
  std::array<ViewOfSurfel, kMaxViews> views_;
  std::array<double, kMaxViews> incidence_{};  // cosines
  std::array<bool, kMaxViews> matches_{};      // another one
  double reconstructability_ = 0;
  Eigen::Matrix3d information_ = Eigen::Matrix3d::Zero();  // of those that match
};

}  // namespace skein
