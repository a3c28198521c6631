#include "matching/two_view.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "geometry/free_focal.h"
#include "sfm/random.h"
#include "sfm/robust_model.h"

namespace skein {
namespace {

// COLMAP's TwoViewGeometry::Options.
constexpr double kMinEFInlierRatio = 0.95;
constexpr double kMaxHInlierRatio = 0.8;

// A search draws its samples from the surest matches first.
constexpr int kMaxTrials = 1000;

// Even when all matches must be inliers, some samples are too close together for a good model.
constexpr double kMaxAssumedInlierRatio = 0.7;

// The matched points of a pair.
struct Correspondences {
  std::vector<Eigen::Vector2d> points1, points2;          // pixels
  std::vector<Eigen::Vector2d> normalized1, normalized2;  // on the plane z = 1
};

Correspondences Gather(const Camera& camera1, const std::vector<Eigen::Vector2d>& points1,
                       const Camera& camera2, const std::vector<Eigen::Vector2d>& points2,
                       const FeatureMatches& matches) {
  Correspondences c;
  for (const FeatureMatch& match : matches) {
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

RansacLimits Limits() {
  RansacLimits limits;
  limits.max_error = limits::kMaxErrorPx;
  limits.confidence = kTwoViewConfidence;
  limits.max_num_trials = kMaxTrials;
  limits.min_inlier_ratio = kMinPairInlierRatio;
  return limits;
}

// Of a search that ends where a model with so many inliers would have been found.
RansacLimits LimitsByOutcome(double useful_inliers, size_t num_matches) {
  RansacLimits limits = Limits();
  const double ratio = std::min(kMaxAssumedInlierRatio, useful_inliers / num_matches);
  limits.min_inlier_ratio = std::max(limits.min_inlier_ratio, ratio);
  return limits;
}

struct Models {
  RobustModel E, F, H;
};

bool IsSupported(const RobustModel& model) {
  return model.found && model.num_inliers >= kMinPairInliers;
}

bool HavePriors(const Camera& camera1, const Camera& camera2) {
  return camera1.HasPriorFocalLength() && camera2.HasPriorFocalLength();
}

TwoViewGeometry Degenerate() {
  TwoViewGeometry geometry;
  geometry.config = TwoViewGeometry::DEGENERATE;
  return geometry;
}

Eigen::Matrix3d FundamentalFromEssential(const Eigen::Matrix3d& E, const Camera& camera1,
                                         const Camera& camera2) {
  return camera2.CalibrationMatrix().inverse().transpose() * E *
         camera1.CalibrationMatrix().inverse();
}

// Samples of the epipolar model's inliers: H matters if it explains 0.8 of them.
RobustModel SearchHomographyWithin(const RobustModel& epipolar, const Correspondences& c) {
  std::vector<Eigen::Vector2d> inliers1, inliers2;
  for (size_t i = 0; i < c.points1.size(); ++i) {
    if (!epipolar.inlier_mask[i]) continue;
    inliers1.push_back(c.points1[i]);
    inliers2.push_back(c.points2[i]);
  }
  const RansacLimits limits = LimitsByOutcome(kMaxHInlierRatio * inliers1.size(), inliers1.size());
  const RobustModel H = SearchHomography(limits, inliers1, inliers2);
  if (!H.found) return H;
  return RefineHomography(H.matrix, c.points1, c.points2, limits.max_error);
}

// E with focal priors, else F.
RobustModel SearchEpipolar(const RansacLimits& limits, const Camera& camera1, const Camera& camera2,
                           const Correspondences& c) {
  if (!HavePriors(camera1, camera2)) return SearchFundamental(limits, c.points1, c.points2);
  RansacLimits of_essential = limits;
  of_essential.max_error = NormalizedError(camera1, camera2, limits.max_error);
  return SearchEssential(of_essential, Sampling::kSurestFirst, c.normalized1, c.normalized2);
}

// One search, for the model that explains most. The others start from what it found.
Models SearchModels(const Camera& camera1, const Camera& camera2, const Correspondences& c) {
  const RansacLimits limits = LimitsByOutcome(kMinPairInliers, c.points1.size());
  Models models;
  RobustModel& found = HavePriors(camera1, camera2) ? models.E : models.F;
  found = SearchEpipolar(limits, camera1, camera2, c);
  if (models.E.found) {
    models.F = RefineFundamental(FundamentalFromEssential(models.E.matrix, camera1, camera2),
                                 c.points1, c.points2, limits.max_error);
  }
  const RobustModel& epipolar = models.F.num_inliers > models.E.num_inliers ? models.F : models.E;
  models.H = epipolar.num_inliers >= kMinPairInliers
                 ? SearchHomographyWithin(epipolar, c)
                 : SearchHomography(limits, c.points1, c.points2);
  return models;
}

// Decides as TwoViewGeometry::EstimateCalibrated and EstimateUncalibrated do; without priors E is
// not found. Returns the configuration and the model whose inliers are kept.
struct Decision {
  int config = TwoViewGeometry::DEGENERATE;
  const RobustModel* inliers_of = nullptr;
};

Decision Decide(const Models& models) {
  const auto& [E, F, H] = models;
  const bool calibrated = IsSupported(E) && E.num_inliers > kMinEFInlierRatio * F.num_inliers;
  if (!calibrated && !IsSupported(F)) {
    if (!IsSupported(H)) return {};
    return {TwoViewGeometry::PLANAR_OR_PANORAMIC, &H};
  }
  const RobustModel& epipolar = calibrated ? E : F;
  const RobustModel* largest = E.num_inliers >= F.num_inliers && calibrated ? &E : &F;
  if (H.num_inliers <= kMaxHInlierRatio * epipolar.num_inliers) {
    return {calibrated ? TwoViewGeometry::CALIBRATED : TwoViewGeometry::UNCALIBRATED, largest};
  }
  if (H.num_inliers > largest->num_inliers) largest = &H;
  return {TwoViewGeometry::PLANAR_OR_PANORAMIC, largest};
}

Eigen::Matrix3d EssentialFromFundamental(const Eigen::Matrix3d& F, const Camera& camera1,
                                         const Camera& camera2) {
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
void EstimatePose(const Camera& camera1, const std::vector<Eigen::Vector2d>& points1,
                  const Camera& camera2, const std::vector<Eigen::Vector2d>& points2,
                  TwoViewGeometry* geometry) {
  constexpr size_t kMaxPoints = 100;
  FeatureMatches all = std::move(geometry->inlier_matches);
  const size_t count = std::min(all.size(), kMaxPoints);
  geometry->inlier_matches.clear();
  for (size_t i = 0; i < count; ++i) {
    geometry->inlier_matches.push_back(all[i * all.size() / count]);
  }
  EstimateRelativePose({camera1, points1, camera2, points2}, geometry);
  geometry->inlier_matches = std::move(all);
  ResetPoseUnlessFinite(geometry);
}

FocalBelief BeliefOf(const Camera& camera) {
  return {camera.MeanFocalLength(),
          camera.HasPriorFocalLength() ? limits::kFocalSigmaExif : limits::kFocalSigmaGuess};
}

// Of the inliers. With a focal length that is a little wrong a rotation's matches have an invented
// parallax.
bool IsRotationWithAnyFocalLengths(const Camera& camera1,
                                   const std::vector<Eigen::Vector2d>& points1,
                                   const Camera& camera2,
                                   const std::vector<Eigen::Vector2d>& points2,
                                   const FeatureMatches& inliers) {
  const Eigen::Vector2d center1(camera1.PrincipalPointX(), camera1.PrincipalPointY());
  const Eigen::Vector2d center2(camera2.PrincipalPointX(), camera2.PrincipalPointY());
  PairPixels pixels;
  for (const FeatureMatch& match : inliers) {
    pixels.first.push_back(points1[match.point2D_idx1] - center1);
    pixels.second.push_back(points2[match.point2D_idx2] - center2);
  }
  return IsRotation(pixels, {BeliefOf(camera1), BeliefOf(camera2)});
}

TwoViewGeometry Conclude(const Camera& camera1, const std::vector<Eigen::Vector2d>& points1,
                         const Camera& camera2, const std::vector<Eigen::Vector2d>& points2,
                         const FeatureMatches& matches, const Correspondences& c,
                         const Models& models) {
  const Decision decision = Decide(models);
  TwoViewGeometry geometry = Degenerate();
  if (!decision.inliers_of) return geometry;
  geometry.config = decision.config;
  geometry.F = models.F.matrix;
  geometry.H = models.H.matrix;
  geometry.E = models.E.num_inliers >= kMinPairInliers
                   ? models.E.matrix
                   : EssentialFromFundamental(models.F.matrix, camera1, camera2);
  for (size_t i = 0; i < matches.size(); ++i) {
    if (decision.inliers_of->inlier_mask[i]) geometry.inlier_matches.push_back(matches[i]);
  }
  if (IsWatermark({camera1, c.points1, camera2, c.points2},
                  static_cast<size_t>(decision.inliers_of->num_inliers),
                  decision.inliers_of->inlier_mask, Limits())) {
    geometry.config = TwoViewGeometry::WATERMARK;
    return geometry;
  }
  EstimatePose(camera1, points1, camera2, points2, &geometry);
  if (geometry.tri_angle > 0 &&
      IsRotationWithAnyFocalLengths(camera1, points1, camera2, points2, geometry.inlier_matches)) {
    geometry.config = TwoViewGeometry::PANORAMIC;
    geometry.tvec.setZero();
    geometry.tri_angle = 0;
  }
  return geometry;
}

}  // namespace

Camera PriorCamera(int width_px, int height_px, double focal_px, bool focal_is_prior) {
  if (width_px <= 0 || height_px <= 0 || !(focal_px > 0) || !std::isfinite(focal_px)) {
    throw std::invalid_argument("camera without size or focal length");
  }
  Camera camera;
  camera.InitializeWithName("SIMPLE_RADIAL", focal_px, width_px, height_px);
  camera.SetPriorFocalLength(focal_is_prior);
  return camera;
}

TwoViewGeometry EstimateTwoView(const Camera& camera1, const std::vector<Eigen::Vector2d>& points1,
                                const Camera& camera2, const std::vector<Eigen::Vector2d>& points2,
                                const FeatureMatches& matches, uint32_t seed) {
  const Correspondences c = Gather(camera1, points1, camera2, points2, matches);
  if (matches.size() < static_cast<size_t>(kMinPairInliers)) return Degenerate();
  SetRandomSeed(seed);
  const Models models = SearchModels(camera1, camera2, c);
  return Conclude(camera1, points1, camera2, points2, matches, c, models);
}

bool HaveGeometry(const Camera& camera1, const std::vector<Eigen::Vector2d>& points1,
                  const Camera& camera2, const std::vector<Eigen::Vector2d>& points2,
                  const FeatureMatches& matches, uint32_t seed) {
  const Correspondences c = Gather(camera1, points1, camera2, points2, matches);
  if (matches.size() < static_cast<size_t>(kMinPairInliers)) return false;
  SetRandomSeed(seed);
  const RansacLimits limits = LimitsByOutcome(kMinPairInliers, matches.size());
  return IsSupported(SearchEpipolar(limits, camera1, camera2, c)) ||
         IsSupported(SearchHomography(limits, c.points1, c.points2));
}

Eigen::Matrix3d EpipolarModel(const Camera& camera1, const Camera& camera2,
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
