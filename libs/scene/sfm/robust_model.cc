#include "sfm/robust_model.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "sfm/colmap_api.h"
#include "sfm/five_point.h"
#include "sfm/four_point.h"

namespace skein {
namespace {

// Chum and Matas 2005, equation 3 in closed form.
class SurestFirstSampler : public colmap_api::SamplerOf<SurestFirstSampler> {
 public:
  explicit SurestFirstSampler(size_t sample_size) : sample_size_(sample_size) {}

  void Initialize(size_t num_matches) override {
    num_matches_ = num_matches;
    num_drawn_ = 0;
  }

  size_t MaxNumSamples() override { return std::numeric_limits<size_t>::max(); }

  void Draw(std::vector<size_t>* sample) {
    constexpr double kUniformAfter = 200000;  // draws; Chum and Matas, section 2.1
    const double share = std::pow(++num_drawn_ / kUniformAfter, 1.0 / sample_size_);
    const auto wanted = static_cast<size_t>(std::ceil(share * num_matches_));
    const size_t num_surest = std::clamp(wanted, sample_size_, num_matches_);
    while (sample->size() < sample_size_) {
      const size_t i = colmap_api::RandomUpTo(static_cast<uint32_t>(num_surest - 1));
      if (std::find(sample->begin(), sample->end(), i) == sample->end()) sample->push_back(i);
    }
  }

 private:
  size_t sample_size_, num_matches_ = 0;
  double num_drawn_ = 0;
};

using Essential = colmap::EssentialMatrixFivePointEstimator;
using Fundamental7 = colmap::FundamentalMatrixSevenPointEstimator;
using Fundamental8 = colmap::FundamentalMatrixEightPointEstimator;
using Homography = colmap::HomographyMatrixEstimator;

template <typename Estimator, typename LocalEstimator>
using SurestFirst =
    colmap::LORANSAC<Estimator, LocalEstimator, colmap::InlierSupportMeasurer, SurestFirstSampler>;

template <typename Ransac>
RobustModel Search(const RansacLimits& limits, const Points2& points1, const Points2& points2) {
  auto report = Ransac(colmap_api::ToColmap(limits)).Estimate(points1, points2);
  RobustModel model;
  model.found = report.success;
  if (!report.success) return model;
  model.num_inliers = report.support.num_inliers;
  model.matrix = report.model;
  model.inlier_mask = std::move(report.inlier_mask);
  return model;
}

template <typename Estimator>
RobustModel Support(const Eigen::Matrix3d& matrix, const Points2& points1, const Points2& points2,
                    double max_error) {
  std::vector<double> residuals;
  Estimator::Residuals(points1, points2, matrix, &residuals);
  RobustModel model;
  model.found = true;
  model.matrix = matrix;
  model.inlier_mask.resize(residuals.size());
  const double max_residual = max_error * max_error;
  for (size_t i = 0; i < residuals.size(); ++i) {
    const bool is_inlier = residuals[i] <= max_residual;  // also false for NaN
    model.inlier_mask[i] = is_inlier;
    model.num_inliers += is_inlier;
    model.cost += is_inlier ? residuals[i] : max_residual;
  }
  return model;
}

template <typename Estimator>
RobustModel Refine(const Eigen::Matrix3d& start, const Points2& points1, const Points2& points2,
                   double max_error) {
  constexpr double kMaxFitted = 300;
  constexpr int kMaxRounds = 3;
  RobustModel best = Support<Estimator>(start, points1, points2, max_error);
  for (int round = 0; round < kMaxRounds; ++round) {
    const double step = std::max(1.0, best.num_inliers / kMaxFitted);
    Points2 inliers1, inliers2;
    double seen = 0;
    for (size_t i = 0; i < points1.size(); ++i) {
      if (!best.inlier_mask[i] || seen++ < step * inliers1.size()) continue;
      inliers1.push_back(points1[i]);
      inliers2.push_back(points2[i]);
    }
    if (inliers1.size() < Estimator::kMinNumSamples) break;
    const double before = best.cost;
    for (const Eigen::Matrix3d& matrix : colmap_api::Models<Estimator>(inliers1, inliers2)) {
      RobustModel model = Support<Estimator>(matrix, points1, points2, max_error);
      if (model.cost < best.cost) best = std::move(model);
    }
    if (best.cost == before) break;
  }
  return best;
}

}  // namespace

RobustModel SearchEssential(const RansacLimits& limits, Sampling sampling, const Points2& points1,
                            const Points2& points2) {
  using FivePoint = colmap_api::ForRansac<FivePointEstimator>;
  return sampling == Sampling::kUniform
             ? Search<colmap::LORANSAC<Essential, Essential>>(limits, points1, points2)
             : Search<SurestFirst<FivePoint, Essential>>(limits, points1, points2);
}

RobustModel SearchFundamental(const RansacLimits& limits, const Points2& points1,
                              const Points2& points2) {
  return Search<SurestFirst<Fundamental7, Fundamental8>>(limits, points1, points2);
}

RobustModel SearchHomography(const RansacLimits& limits, const Points2& points1,
                             const Points2& points2) {
  using FourPoint = colmap_api::ForRansac<FourPointEstimator>;
  return Search<SurestFirst<FourPoint, Homography>>(limits, points1, points2);
}

RobustModel RefineFundamental(const Eigen::Matrix3d& start, const Points2& points1,
                              const Points2& points2, double max_error_px) {
  return Refine<Fundamental8>(start, points1, points2, max_error_px);
}

RobustModel RefineHomography(const Eigen::Matrix3d& start, const Points2& points1,
                             const Points2& points2, double max_error_px) {
  return Refine<Homography>(start, points1, points2, max_error_px);
}

}  // namespace skein
