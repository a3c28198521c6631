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

// Joint quality of a surfel's photos, and the quality with one more.
class AssessedViews {
 public:
  AssessedViews() = default;
  AssessedViews(double target_gsd, const Eigen::Vector3d& normal,
                const std::vector<ViewOfSurfel>& views);

  // As AssessSurfel of the views.
  SurfelQuality Quality() const { return QualityOf(sums_); }
  // As AssessSurfel of the views and this one. Costs 1/8 of it, or as much where there are more
  // than kMaxViews and this is among the best.
  SurfelQuality QualityWith(const ViewOfSurfel& view) const;

 private:
  // More photos of a surfel say little; the cost of pairs is quadratic.
  static constexpr size_t kMaxViews = 16;

  struct Sums {
    int num_photos = 0;
    double best_gsd = std::numeric_limits<double>::infinity(), second_gsd = best_gsd;
    // Over pairs of the best views, and over those that match another one.
    double reconstructability = 0;
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    double sigma = std::numeric_limits<double>::infinity();  // along the normal, of `information`

    void Count(const ViewOfSurfel& view);
  };

  double RankOf(const ViewOfSurfel& view) const;
  void Add(const ViewOfSurfel& view);
  bool AddPairs(const ViewOfSurfel& view, std::array<bool, kMaxViews>* matches, Sums* sums) const;
  SurfelQuality QualityOf(const Sums& sums) const;

  double target_gsd_ = 0;
  Eigen::Vector3d normal_ = Eigen::Vector3d::Zero();
  Sums sums_;
  // The best ones, at most kMaxViews.
  size_t num_ = 0;
  std::array<ViewOfSurfel, kMaxViews> views_;
  std::array<double, kMaxViews> incidence_{};  // cosines
  std::array<bool, kMaxViews> matches_{};      // another one
};

}  // namespace skein
