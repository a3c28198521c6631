// Photos that see a surfel, with direction and ground sampling distance.
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

// Quality of a surfel by all its photos, and with one more photo. Not thread-safe.
class AssessedViews {
 public:
  AssessedViews() = default;
  AssessedViews(double target_gsd, const Eigen::Vector3d& normal,
                const std::vector<ViewOfSurfel>& views);

  // As AssessSurfel of the views.
  SurfelQuality Quality() const { return QualityOf(sums_); }
  // Equals AssessSurfel of the views and `view`. Takes 1/8 of its time; as much as AssessSurfel if
  // there are more than kMaxViews views and `view` is one of the best.
  SurfelQuality QualityWith(const ViewOfSurfel& view) const;

 private:
  // Only the best kMaxViews photos are paired: further ones change little, and pairs cost O(n^2).
  static constexpr size_t kMaxViews = 16;

  struct Sums {
    int num_photos = 0;
    double best_gsd = std::numeric_limits<double>::infinity(), second_gsd = best_gsd;
    // `reconstructability`: sum over pairs of the best views. `information`: sum over the best
    // views that match another one.
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
