#include "matching/two_view.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/option_check.h"
#include "estimators/essential_matrix.h"
#include "estimators/fundamental_matrix.h"
#include "estimators/homography_matrix.h"
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

using EssentialRansac = colmap::LORANSAC<colmap::EssentialMatrixFivePointEstimator,
                                         colmap::EssentialMatrixFivePointEstimator>;
using FundamentalRansac = colmap::LORANSAC<colmap::FundamentalMatrixSevenPointEstimator,
                                           colmap::FundamentalMatrixEightPointEstimator>;
using HomographyRansac =
    colmap::LORANSAC<colmap::HomographyMatrixEstimator, colmap::HomographyMatrixEstimator>;

// The part of a RANSAC report that is used.
struct Model {
  bool found = false;
  double num_inliers = 0;
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

// In COLMAP's order, as each draws random numbers; E only with focal priors.
Models SearchModels(const colmap::Camera& camera1, const colmap::Camera& camera2,
                    const Correspondences& c, const TwoViewOptions& options) {
  const size_t n = c.points1.size();
  const double min_inliers = options.min_num_inliers;
  const double max_error_px = options.max_error_px;
  Models models;
  if (camera1.HasPriorFocalLength() && camera2.HasPriorFocalLength()) {
    const double max_error = (camera1.ImageToWorldThreshold(max_error_px) +
                              camera2.ImageToWorldThreshold(max_error_px)) /
                             2;
    models.E = Search(EssentialRansac(RansacOptions(options, max_error, min_inliers, n)),
                      c.normalized1, c.normalized2);
  }
  const double useful_F = std::max(min_inliers, models.E.num_inliers);
  models.F = Search(FundamentalRansac(RansacOptions(options, max_error_px, useful_F, n)), c.points1,
                    c.points2);
  const double epipolar = std::max(models.E.num_inliers, models.F.num_inliers);
  const double useful_H =
      std::max(min_inliers, epipolar < min_inliers ? 0.0 : kMaxHInlierRatio * epipolar);
  models.H = Search(HomographyRansac(RansacOptions(options, max_error_px, useful_H, n)), c.points1,
                    c.points2);
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
  TwoViewGeometry geometry;
  geometry.config = TwoViewGeometry::DEGENERATE;
  const Correspondences c = Gather(camera1, points1, camera2, points2, matches);
  if (matches.size() < static_cast<size_t>(options.min_num_inliers)) return geometry;

  colmap::SetPRNGSeed(seed);
  const Models models = SearchModels(camera1, camera2, c, options);
  const Decision decision = Decide(models, options.min_num_inliers);
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
  geometry.EstimateRelativePose(camera1, points1, camera2, points2);
  ResetPoseUnlessFinite(&geometry);
  return geometry;
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
