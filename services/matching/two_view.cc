#include "matching/two_view.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "core/option_check.h"
#include "estimators/essential_matrix.h"
#include "estimators/fundamental_matrix.h"
#include "estimators/homography_matrix.h"
#include "geometry/free_focal.h"
#include "matching/five_point.h"
#include "matching/four_point.h"
#include "optim/loransac.h"
#include "util/random.h"

namespace skein {
namespace {

using colmap::TwoViewGeometry;

// COLMAP's TwoViewGeometry::Options.
constexpr double kMinEFInlierRatio = 0.95;
constexpr double kMaxHInlierRatio = 0.8;

// Even when all matches must be inliers, some samples are too close together for a good model.
constexpr double kMaxAssumedInlierRatio = 0.7;

// Samples of the first, surest matches, more of them with each draw (PROSAC; Chum and Matas 2005,
// equation 3 in closed form).
class SurestFirstSampler : public colmap::Sampler {
 public:
  explicit SurestFirstSampler(size_t sample_size) : sample_size_(sample_size) {}

  void Initialize(size_t num_matches) override {
    num_matches_ = num_matches;
    num_drawn_ = 0;
  }

  size_t MaxNumSamples() override { return std::numeric_limits<size_t>::max(); }

  std::vector<size_t> Sample() override {
    constexpr double kUniformAfter = 200000;  // draws; Chum and Matas, section 2.1
    const double share = std::pow(++num_drawn_ / kUniformAfter, 1.0 / sample_size_);
    const auto wanted = static_cast<size_t>(std::ceil(share * num_matches_));
    const size_t num_surest = std::clamp(wanted, sample_size_, num_matches_);
    std::vector<size_t> sample;
    while (sample.size() < sample_size_) {
      const size_t i = colmap::RandomInteger<uint32_t>(0, static_cast<uint32_t>(num_surest - 1));
      if (std::find(sample.begin(), sample.end(), i) == sample.end()) sample.push_back(i);
    }
    return sample;
  }

 private:
  size_t sample_size_, num_matches_ = 0;
  double num_drawn_ = 0;
};

template <typename Estimator, typename LocalEstimator>
using SurestFirst =
    colmap::LORANSAC<Estimator, LocalEstimator, colmap::InlierSupportMeasurer, SurestFirstSampler>;
using EssentialRansac = SurestFirst<FivePointEstimator, colmap::EssentialMatrixFivePointEstimator>;
using ColmapEssentialRansac = colmap::LORANSAC<colmap::EssentialMatrixFivePointEstimator,
                                               colmap::EssentialMatrixFivePointEstimator>;
using FundamentalRansac = SurestFirst<colmap::FundamentalMatrixSevenPointEstimator,
                                      colmap::FundamentalMatrixEightPointEstimator>;
using ColmapFundamentalRansac = colmap::LORANSAC<colmap::FundamentalMatrixSevenPointEstimator,
                                                 colmap::FundamentalMatrixEightPointEstimator>;
using HomographyRansac = SurestFirst<FourPointEstimator, colmap::HomographyMatrixEstimator>;
using ColmapHomographyRansac =
    colmap::LORANSAC<colmap::HomographyMatrixEstimator, colmap::HomographyMatrixEstimator>;

// The part of a RANSAC report that is used.
struct Model {
  bool found = false;
  double num_inliers = 0;
  double cost = 0;  // of Refine: truncated sum of squared errors
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  std::vector<char> inlier_mask;
};

// The matched points of a pair.
struct Correspondences {
  std::vector<Eigen::Vector2d> points1, points2;          // pixels
  std::vector<Eigen::Vector2d> normalized1, normalized2;  // on the plane z = 1
};

Correspondences Gather(const colmap::Camera& camera1, const std::vector<Eigen::Vector2d>& points1,
                       const colmap::Camera& camera2, const std::vector<Eigen::Vector2d>& points2,
                       const colmap::FeatureMatches& matches) {
  Correspondences c;
  for (const colmap::FeatureMatch& match : matches) {
    if (match.point2D_idx1 >= points1.size() || match.point2D_idx2 >= points2.size()) {
      throw std::invalid_argument("a match refers to a keypoint that does not exist");
    }
    c.points1.push_back(points1[match.point2D_idx1]);
    c.points2.push_back(points2[match.point2D_idx2]);
    c.normalized1.push_back(camera1.ImageToWorld(c.points1.back()));
    c.normalized2.push_back(camera2.ImageToWorld(c.points2.back()));
  }
  return c;
}

colmap::RANSACOptions RansacOptions(const TwoViewOptions& options, double max_error,
                                    double useful_inliers, size_t num_matches) {
  colmap::RANSACOptions ransac;
  ransac.max_error = max_error;
  ransac.confidence = options.confidence;
  ransac.max_num_trials = options.max_num_trials;
  ransac.min_inlier_ratio = options.min_inlier_ratio;
  if (options.limit_trials_by_outcome) {
    const double ratio = std::min(kMaxAssumedInlierRatio, useful_inliers / num_matches);
    ransac.min_inlier_ratio = std::max(ransac.min_inlier_ratio, ratio);
  }
  return ransac;
}

template <typename Ransac>
Model Search(Ransac ransac, const std::vector<Eigen::Vector2d>& points1,
             const std::vector<Eigen::Vector2d>& points2) {
  const auto report = ransac.Estimate(points1, points2);
  Model model;
  model.found = report.success;
  if (!report.success) return model;
  model.num_inliers = report.support.num_inliers;
  model.matrix = report.model;
  model.inlier_mask = report.inlier_mask;
  return model;
}

struct Models {
  Model E, F, H;
};

bool HavePriors(const colmap::Camera& camera1, const colmap::Camera& camera2) {
  return camera1.HasPriorFocalLength() && camera2.HasPriorFocalLength();
}

double NormalizedError(const colmap::Camera& camera1, const colmap::Camera& camera2,
                       double error_px) {
  return (camera1.ImageToWorldThreshold(error_px) + camera2.ImageToWorldThreshold(error_px)) / 2;
}

TwoViewGeometry Degenerate() {
  TwoViewGeometry geometry;
  geometry.config = TwoViewGeometry::DEGENERATE;
  return geometry;
}

Eigen::Matrix3d FundamentalFromEssential(const Eigen::Matrix3d& E, const colmap::Camera& camera1,
                                         const colmap::Camera& camera2) {
  return camera2.CalibrationMatrix().inverse().transpose() * E *
         camera1.CalibrationMatrix().inverse();
}

template <typename Estimator>
Model Support(const Eigen::Matrix3d& matrix, const std::vector<Eigen::Vector2d>& points1,
              const std::vector<Eigen::Vector2d>& points2, double max_error) {
  std::vector<double> residuals;
  Estimator::Residuals(points1, points2, matrix, &residuals);
  Model model;
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

// Local optimisation as in LO-RANSAC: a fit to the inliers as long as it lowers the truncated sum
// of squared errors (MSAC; Torr and Zisserman 2000). Some hundred inliers, spread evenly over the
// list, determine a model as well as all.
template <typename Estimator>
Model Refine(const Eigen::Matrix3d& start, const std::vector<Eigen::Vector2d>& points1,
             const std::vector<Eigen::Vector2d>& points2, double max_error) {
  constexpr double kMaxFitted = 300;
  constexpr int kMaxRounds = 3;
  Model best = Support<Estimator>(start, points1, points2, max_error);
  for (int round = 0; round < kMaxRounds; ++round) {
    const double step = std::max(1.0, best.num_inliers / kMaxFitted);
    std::vector<Eigen::Vector2d> inliers1, inliers2;
    double seen = 0;
    for (size_t i = 0; i < points1.size(); ++i) {
      if (!best.inlier_mask[i] || seen++ < step * inliers1.size()) continue;
      inliers1.push_back(points1[i]);
      inliers2.push_back(points2[i]);
    }
    if (inliers1.size() < Estimator::kMinNumSamples) break;
    const double before = best.cost;
    for (const Eigen::Matrix3d& matrix : Estimator::Estimate(inliers1, inliers2)) {
      Model model = Support<Estimator>(matrix, points1, points2, max_error);
      if (model.cost < best.cost) best = std::move(model);
    }
    if (best.cost == before) break;
  }
  return best;
}

// As COLMAP: a search of its own for each model, in COLMAP's order, as each draws random numbers.
Models SearchEachModel(const colmap::Camera& camera1, const colmap::Camera& camera2,
                       const Correspondences& c, const TwoViewOptions& options) {
  const size_t n = c.points1.size();
  const double max_error_px = options.max_error_px;
  Models models;
  if (HavePriors(camera1, camera2)) {
    const double max_error = NormalizedError(camera1, camera2, max_error_px);
    models.E = Search(ColmapEssentialRansac(RansacOptions(options, max_error, 0, n)), c.normalized1,
                      c.normalized2);
  }
  models.F = Search(ColmapFundamentalRansac(RansacOptions(options, max_error_px, 0, n)), c.points1,
                    c.points2);
  models.H = Search(ColmapHomographyRansac(RansacOptions(options, max_error_px, 0, n)), c.points1,
                    c.points2);
  return models;
}

// Samples of the epipolar model's inliers: H matters if it explains 0.8 of them.
Model SearchHomographyWithin(const Model& epipolar, const Correspondences& c,
                             const TwoViewOptions& options) {
  std::vector<Eigen::Vector2d> inliers1, inliers2;
  for (size_t i = 0; i < c.points1.size(); ++i) {
    if (!epipolar.inlier_mask[i]) continue;
    inliers1.push_back(c.points1[i]);
    inliers2.push_back(c.points2[i]);
  }
  const Model H =
      Search(HomographyRansac(RansacOptions(options, options.max_error_px,
                                            kMaxHInlierRatio * inliers1.size(), inliers1.size())),
             inliers1, inliers2);
  if (!H.found) return H;
  return Refine<colmap::HomographyMatrixEstimator>(H.matrix, c.points1, c.points2,
                                                   options.max_error_px);
}

// One search, for the model that explains most: E with focal priors, else F. The others start from
// what it found.
Models SearchModels(const colmap::Camera& camera1, const colmap::Camera& camera2,
                    const Correspondences& c, const TwoViewOptions& options) {
  if (!options.limit_trials_by_outcome) return SearchEachModel(camera1, camera2, c, options);
  const size_t n = c.points1.size();
  const double min_inliers = options.min_num_inliers, max_error_px = options.max_error_px;
  Models models;
  if (HavePriors(camera1, camera2)) {
    const double max_error = NormalizedError(camera1, camera2, max_error_px);
    models.E = Search(EssentialRansac(RansacOptions(options, max_error, min_inliers, n)),
                      c.normalized1, c.normalized2);
    if (models.E.found) {
      models.F = Refine<colmap::FundamentalMatrixEightPointEstimator>(
          FundamentalFromEssential(models.E.matrix, camera1, camera2), c.points1, c.points2,
          max_error_px);
    }
  } else {
    models.F = Search(FundamentalRansac(RansacOptions(options, max_error_px, min_inliers, n)),
                      c.points1, c.points2);
  }
  const Model& epipolar = models.F.num_inliers > models.E.num_inliers ? models.F : models.E;
  if (epipolar.num_inliers >= min_inliers) {
    models.H = SearchHomographyWithin(epipolar, c, options);
  } else {
    models.H = Search(HomographyRansac(RansacOptions(options, max_error_px, min_inliers, n)),
                      c.points1, c.points2);
  }
  return models;
}

// Decides as TwoViewGeometry::EstimateCalibrated and EstimateUncalibrated do; without priors E is
// not found. Returns the configuration and the model whose inliers are kept.
struct Decision {
  int config = TwoViewGeometry::DEGENERATE;
  const Model* inliers_of = nullptr;
};

Decision Decide(const Models& models, double min_num_inliers) {
  const auto& [E, F, H] = models;
  const auto supported = [min_num_inliers](const Model& model) {
    return model.found && model.num_inliers >= min_num_inliers;
  };
  const bool calibrated = supported(E) && E.num_inliers > kMinEFInlierRatio * F.num_inliers;
  if (!calibrated && !supported(F)) {
    if (!supported(H)) return {};
    return {TwoViewGeometry::PLANAR_OR_PANORAMIC, &H};
  }
  const Model& epipolar = calibrated ? E : F;
  const Model* largest = E.num_inliers >= F.num_inliers && calibrated ? &E : &F;
  if (H.num_inliers <= kMaxHInlierRatio * epipolar.num_inliers) {
    return {calibrated ? TwoViewGeometry::CALIBRATED : TwoViewGeometry::UNCALIBRATED, largest};
  }
  if (H.num_inliers > largest->num_inliers) largest = &H;
  return {TwoViewGeometry::PLANAR_OR_PANORAMIC, largest};
}

bool IsWatermark(const colmap::Camera& camera1, const colmap::Camera& camera2,
                 const Correspondences& c, const Model& model, const TwoViewOptions& options) {
  TwoViewGeometry::Options colmap_options;
  colmap_options.ransac_options = RansacOptions(options, options.max_error_px, 0, c.points1.size());
  return TwoViewGeometry::DetectWatermark(camera1, c.points1, camera2, c.points2,
                                          static_cast<size_t>(model.num_inliers), model.inlier_mask,
                                          colmap_options);
}

Eigen::Matrix3d EssentialFromFundamental(const Eigen::Matrix3d& F, const colmap::Camera& camera1,
                                         const colmap::Camera& camera2) {
  return camera2.CalibrationMatrix().transpose() * F * camera1.CalibrationMatrix();
}

void ResetPoseUnlessFinite(TwoViewGeometry* geometry) {
  const bool finite = geometry->qvec.allFinite() && geometry->tvec.allFinite() &&
                      std::isfinite(geometry->tri_angle);
  if (finite) return;
  geometry->qvec = Eigen::Vector4d(1, 0, 0, 0);
  geometry->tvec.setZero();
  geometry->tri_angle = 0;
}

// The pose of a pair whose model and inliers are known. Some hundred inliers, spread evenly, tell
// its sign and the median angle.
void EstimatePose(const colmap::Camera& camera1, const std::vector<Eigen::Vector2d>& points1,
                  const colmap::Camera& camera2, const std::vector<Eigen::Vector2d>& points2,
                  TwoViewGeometry* geometry) {
  constexpr size_t kMaxPoints = 100;
  colmap::FeatureMatches all = std::move(geometry->inlier_matches);
  const size_t count = std::min(all.size(), kMaxPoints);
  geometry->inlier_matches.clear();
  for (size_t i = 0; i < count; ++i) {
    geometry->inlier_matches.push_back(all[i * all.size() / count]);
  }
  geometry->EstimateRelativePose(camera1, points1, camera2, points2);
  geometry->inlier_matches = std::move(all);
  ResetPoseUnlessFinite(geometry);
}

FocalBelief BeliefOf(const colmap::Camera& camera) {
  return {camera.MeanFocalLength(),
          camera.HasPriorFocalLength() ? limits::kFocalSigmaExif : limits::kFocalSigmaGuess};
}

// Of the inliers. With a focal length that is a little wrong a rotation's matches have an invented
// parallax.
bool IsRotationWithAnyFocalLengths(const colmap::Camera& camera1,
                                   const std::vector<Eigen::Vector2d>& points1,
                                   const colmap::Camera& camera2,
                                   const std::vector<Eigen::Vector2d>& points2,
                                   const colmap::FeatureMatches& inliers) {
  const Eigen::Vector2d center1(camera1.PrincipalPointX(), camera1.PrincipalPointY());
  const Eigen::Vector2d center2(camera2.PrincipalPointX(), camera2.PrincipalPointY());
  PairPixels pixels;
  for (const colmap::FeatureMatch& match : inliers) {
    pixels.first.push_back(points1[match.point2D_idx1] - center1);
    pixels.second.push_back(points2[match.point2D_idx2] - center2);
  }
  return IsRotation(pixels, {BeliefOf(camera1), BeliefOf(camera2)});
}

TwoViewGeometry Conclude(const colmap::Camera& camera1, const std::vector<Eigen::Vector2d>& points1,
                         const colmap::Camera& camera2, const std::vector<Eigen::Vector2d>& points2,
                         const colmap::FeatureMatches& matches, const Correspondences& c,
                         const Models& models, const TwoViewOptions& options) {
  const Decision decision = Decide(models, options.min_num_inliers);
  TwoViewGeometry geometry = Degenerate();
  if (!decision.inliers_of) return geometry;
  geometry.config = decision.config;
  geometry.F = models.F.matrix;
  geometry.H = models.H.matrix;
  geometry.E = models.E.num_inliers >= options.min_num_inliers
                   ? models.E.matrix
                   : EssentialFromFundamental(models.F.matrix, camera1, camera2);
  for (size_t i = 0; i < matches.size(); ++i) {
    if (decision.inliers_of->inlier_mask[i]) geometry.inlier_matches.push_back(matches[i]);
  }
  if (IsWatermark(camera1, camera2, c, *decision.inliers_of, options)) {
    geometry.config = TwoViewGeometry::WATERMARK;
    return geometry;
  }
  EstimatePose(camera1, points1, camera2, points2, &geometry);
  if (options.limit_trials_by_outcome && geometry.tri_angle > 0 &&
      IsRotationWithAnyFocalLengths(camera1, points1, camera2, points2, geometry.inlier_matches)) {
    geometry.config = TwoViewGeometry::PANORAMIC;
    geometry.tvec.setZero();
    geometry.tri_angle = 0;
  }
  return geometry;
}

}  // namespace

Status TwoViewOptions::Check() const {
  return FirstError({InRange("max_error", max_error_px, 0.1, 1000.0),
                     InRange("confidence", confidence, 0.0, 0.999999999),
                     InRange("min_inliers", min_num_inliers, 8, 10000),
                     InRange("min_inlier_ratio", min_inlier_ratio, 0.01, 1.0),
                     InRange("max_trials", max_num_trials, 1, 10'000'000)});
}

colmap::Camera PriorCamera(int width_px, int height_px, double focal_px, bool focal_is_prior) {
  if (width_px <= 0 || height_px <= 0 || !(focal_px > 0) || !std::isfinite(focal_px)) {
    throw std::invalid_argument("camera without size or focal length");
  }
  colmap::Camera camera;
  camera.InitializeWithName("SIMPLE_RADIAL", focal_px, width_px, height_px);
  camera.SetPriorFocalLength(focal_is_prior);
  return camera;
}

TwoViewGeometry EstimateTwoView(const colmap::Camera& camera1,
                                const std::vector<Eigen::Vector2d>& points1,
                                const colmap::Camera& camera2,
                                const std::vector<Eigen::Vector2d>& points2,
                                const colmap::FeatureMatches& matches, uint32_t seed,
                                const TwoViewOptions& options) {
  ThrowUnlessSound(options.Check());
  const Correspondences c = Gather(camera1, points1, camera2, points2, matches);
  if (matches.size() < static_cast<size_t>(options.min_num_inliers)) return Degenerate();
  colmap::SetPRNGSeed(seed);
  return Conclude(camera1, points1, camera2, points2, matches, c,
                  SearchModels(camera1, camera2, c, options), options);
}

Eigen::Matrix3d EpipolarModel(const colmap::Camera& camera1, const colmap::Camera& camera2,
                              const TwoViewGeometry& geometry) {
  if (!HavePriors(camera1, camera2) || geometry.config == TwoViewGeometry::UNCALIBRATED) {
    return geometry.F;
  }
  return FundamentalFromEssential(geometry.E, camera1, camera2);
}

bool IsVerified(const TwoViewGeometry& geometry) {
  switch (geometry.config) {
    case TwoViewGeometry::CALIBRATED:
    case TwoViewGeometry::UNCALIBRATED:
    case TwoViewGeometry::PLANAR:
    case TwoViewGeometry::PANORAMIC:
    case TwoViewGeometry::PLANAR_OR_PANORAMIC:
      return true;
    default:
      return false;
  }
}

double ForwardMotion(const TwoViewGeometry& geometry) {
  const double norm = geometry.tvec.norm();
  return norm > 0 ? std::abs(geometry.tvec.z()) / norm : 0.0;
}

}  // namespace skein
