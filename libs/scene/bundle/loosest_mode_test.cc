#include "bundle/loosest_mode.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "testing/synthetic_scene.h"
#include "testing/test_random.h"

namespace skein::loosest_mode_test {

constexpr double kWallRadius = 19, kPathRadius = 15;
constexpr double kStepDeg = 3.6, kThinDeg = 12;

// Photos along a round corridor, which look at its outer wall. 360 degrees close it to a loop. Of
// the wall, kThinDeg from `thin_from_deg` on have a twentieth of the points.
SyntheticScene RoundCorridor(const SyntheticOptions& options, int degrees, double thin_from_deg) {
  std::mt19937 random(options.seed);
  SyntheticScene scene;
  for (int i = 0; i < options.num_points; ++i) {
    const double angle_deg = Uniform(-10, degrees + 10, &random);
    const double from_thin_deg = angle_deg - thin_from_deg;
    const double keep = Uniform(0, 1, &random);
    const double radius = kWallRadius + Uniform(-1, 1, &random), y = Uniform(-2, 2, &random);
    if (degrees == 360 && (angle_deg < 0 || angle_deg >= 360)) continue;
    if (from_thin_deg > 0 && from_thin_deg < kThinDeg && keep > 0.05) continue;
    const double angle = angle_deg * M_PI / 180;
    scene.points.emplace_back(radius * std::sin(angle), y, radius * std::cos(angle));
  }
  for (int k = 0; k * kStepDeg < degrees - 0.1; ++k) {
    const double angle = k * kStepDeg * M_PI / 180;
    scene.AddPose(Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitY()).matrix(),
                  kPathRadius * Eigen::Vector3d(std::sin(angle), 0, std::cos(angle)));
  }
  Photograph(options, &random, &scene);
  return scene;
}

constexpr double kNowhere = 1e3;

// Radial errors that a photo's keypoints share, as of a lens that focuses anew for each photo.
// `sigma_px`: of their size at the upper border.
void DistortPhotos(double sigma_px, const SyntheticOptions& options, Bundle* bundle) {
  std::mt19937 random(options.seed);
  std::normal_distribution<double> normal(0, sigma_px);
  std::vector<double> sizes;
  for (size_t i = 0; i < bundle->poses.size(); ++i) sizes.push_back(normal(random));
  const Eigen::Vector2d center(options.camera.width_px / 2.0, options.camera.height_px / 2.0);
  for (BundleObservation& observation : bundle->observations) {
    const Eigen::Vector2d radius = (observation.pixel - center) / center.y();
    observation.pixel += sizes[observation.pose] * radius.squaredNorm() * radius;
  }
}

Bundle Adjusted(const SyntheticOptions& options, const SyntheticScene& scene,
                double distorted_px = 0) {
  Bundle bundle = BundleAtTruth(options, scene);
  DistortPhotos(distorted_px, options, &bundle);
  BundleOptions solve;
  solve.function_tolerance = 1e-10;
  solve.max_iterations = 100;
  EXPECT_TRUE(SolveBundle(solve, &bundle).usable);
  return bundle;
}

SyntheticOptions Corridor(unsigned seed = 1) {
  SyntheticOptions options;
  options.seed = seed;
  options.num_points = 4000;
  options.detection_rate = 0.7;
  return options;
}

double SigmaOf(const Bundle& bundle) {
  const std::optional<LoosestMode> mode = FindLoosestMode(bundle);
  return mode ? mode->sigma : HUGE_VAL;
}

// Photos of the whole corridor from above, as of a drone.
void AddOverviews(const SyntheticOptions& options, SyntheticScene* scene) {
  const Eigen::Matrix3d down = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitX()).matrix();
  for (const double x : {-10, 0, 10}) scene->AddPose(down, Eigen::Vector3d(x, -60, 0));
  std::mt19937 random(options.seed);
  Photograph(options, &random, scene);
}

TEST(LoosestMode, OfALongChainItIsLargeAndOverviewsStiffenIt) {
  const SyntheticOptions options = Corridor();
  SyntheticScene scene = RoundCorridor(options, 270, kNowhere);
  const Bundle chain = BundleAtTruth(options, scene);
  AddOverviews(options, &scene);
  const Bundle with_overviews = BundleAtTruth(options, scene);
  ASSERT_GT(with_overviews.observations.size(), chain.observations.size() + 3000);
  EXPECT_GT(SigmaOf(chain), 3 * SigmaOf(with_overviews));
}

// Of a chain of half the length, the mode is far smaller: errors of its links add up.
TEST(LoosestMode, OfAShorterChainItIsSmaller) {
  const SyntheticOptions options = Corridor();
  const double whole = SigmaOf(BundleAtTruth(options, RoundCorridor(options, 300, kNowhere)));
  const double half = SigmaOf(BundleAtTruth(options, RoundCorridor(options, 150, kNowhere)));
  EXPECT_GT(whole, 2 * half);
}

// Centres of the bundle less those of the scene, the best small similarity taken out.
double RmsError(const SyntheticScene& scene, const Bundle& bundle) {
  const size_t num = bundle.poses.size();
  Eigen::MatrixXd from(3, num), to(3, num);
  for (size_t i = 0; i < num; ++i) {
    from.col(i) = -(bundle.poses[i].R.transpose() * bundle.poses[i].t);
    to.col(i) = scene.Center(i);
  }
  const Eigen::Matrix4d similarity = Eigen::umeyama(from, to, true);
  const Eigen::MatrixXd errors = (similarity.topRows<3>() * from.colwise().homogeneous()) - to;
  return std::sqrt(errors.squaredNorm() / static_cast<double>(num));
}

struct Errors {
  double actual = 0, expected = 0;  // RMS over draws of the noise
};

Errors ErrorsOf(SyntheticOptions options, int degrees, double distorted_px = 0) {
  constexpr int kDraws = 20;
  double squared = 0, expected_squared = 0;
  for (unsigned draw = 0; draw < kDraws; ++draw) {
    options.seed = 100 + draw;
    const SyntheticScene scene = RoundCorridor(options, degrees, kNowhere);
    const Bundle bundle = Adjusted(options, scene, distorted_px);
    squared += std::pow(RmsError(scene, bundle), 2) / kDraws;
    expected_squared += std::pow(FindLoosestMode(bundle)->expected_error, 2) / kDraws;
  }
  return {std::sqrt(squared), std::sqrt(expected_squared)};
}

TEST(LoosestMode, TheExpectedErrorIsThatOfManyDrawsOfNoise) {
  for (const int degrees : {180, 360}) {
    const Errors errors = ErrorsOf(Corridor(), degrees);
    EXPECT_NEAR(errors.actual / errors.expected, 1, 0.25) << degrees;
  }
}

// Few points, much noise.
TEST(LoosestMode, AWeakChainIsBentAsExpected) {
  SyntheticOptions options = Corridor();
  options.num_points = 1200;
  options.noise_px = 2;
  constexpr double kExtent = 2 * kPathRadius;
  const Errors errors = ErrorsOf(options, 300);
  EXPECT_GT(errors.actual, 0.01 * kExtent);
  EXPECT_GT(errors.expected, 0.01 * kExtent);
  EXPECT_NEAR(errors.actual / errors.expected, 1, 0.4);
}

// Noise of the residuals' size would make a tenth of the error.
TEST(LoosestMode, ErrorsThatAPhotoSharesAreExpectedAsOneDraw) {
  const Errors errors = ErrorsOf(Corridor(), 180, 1);
  EXPECT_NEAR(errors.actual / errors.expected, 3.5, 1.5);
}

TEST(LoosestMode, NoiseIsFoundFromTheResiduals) {
  SyntheticOptions options = Corridor();
  options.noise_px = 0.4;
  const auto mode = FindLoosestMode(Adjusted(options, RoundCorridor(options, 180, kNowhere)));
  ASSERT_TRUE(mode);
  EXPECT_NEAR(mode->noise_px, 0.4, 0.04);
}

TEST(LoosestMode, ItIsTheSameInAnotherFrame) {
  const SyntheticOptions options = Corridor();
  const Bundle bundle = BundleAtTruth(options, RoundCorridor(options, 180, kNowhere));
  const Eigen::Matrix3d R = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, 3).normalized()).matrix();
  const Eigen::Vector3d t(10, -20, 5);
  constexpr double kScale = 7;
  Bundle moved = bundle;
  for (BundlePoint& point : moved.points) point.xyz = kScale * (R * point.xyz) + t;
  for (BundlePose& pose : moved.poses) {
    pose.R = pose.R * R.transpose();
    pose.t = kScale * pose.t - pose.R * t;
  }
  const double sigma = SigmaOf(bundle);
  EXPECT_NEAR(SigmaOf(moved) / kScale, sigma, 0.01 * sigma);
  EXPECT_NEAR(ExtentOf(moved) / kScale, ExtentOf(bundle), 1e-6);
}

// A focal length that may change gives the chain another way to bend.
TEST(LoosestMode, IntrinsicsThatAreRefinedMakeItLooser) {
  const SyntheticOptions options = Corridor();
  Bundle bundle = BundleAtTruth(options, RoundCorridor(options, 180, kNowhere));
  const double sigma = SigmaOf(bundle);
  bundle.cameras[0].refined = {0, 3};
  EXPECT_GT(SigmaOf(bundle), 1.2 * sigma);
  bundle.cameras[0].prior = bundle.cameras[0].params;
  bundle.cameras[0].prior_sigma = {1e-3, 0, 0, 1e-6};
  EXPECT_NEAR(SigmaOf(bundle), sigma, 0.01 * sigma);
}

TEST(LoosestMode, APoseWithoutObservationsIsNotDetermined) {
  const SyntheticOptions options = Corridor();
  Bundle bundle = BundleAtTruth(options, RoundCorridor(options, 72, kNowhere));
  bundle.poses.push_back(bundle.poses.back());
  EXPECT_FALSE(FindLoosestMode(bundle));
}

TEST(LoosestMode, ABundleWithAConstantPoseIsRefused) {
  const SyntheticOptions options = Corridor();
  Bundle bundle = BundleAtTruth(options, RoundCorridor(options, 72, kNowhere));
  bundle.poses[0].constant = true;
  EXPECT_THROW(FindLoosestMode(bundle), std::invalid_argument);
}

// Photos 21 to 28 see the thin part.
TEST(WeakestCut, AThinLinkOfAChainIsNamed) {
  const SyntheticOptions options = Corridor();
  const Bundle bundle = BundleAtTruth(options, RoundCorridor(options, 264, 84));
  const auto mode = FindLoosestMode(bundle);
  ASSERT_TRUE(mode);
  const WeakestCut cut = FindWeakestCut(bundle, MaximumSpanningTree(bundle), mode->displacements);
  ASSERT_GE(cut.loose, 0);
  EXPECT_GE(std::min(cut.loose, cut.anchor), 20);
  EXPECT_LE(std::max(cut.loose, cut.anchor), 29);
  EXPECT_LT(cut.loose, cut.anchor);
  EXPECT_EQ(cut.num_loose, cut.loose + 1);
  EXPECT_GT(cut.explained_share, 0.7);
}

// Two stiff parts, of which one turns about a point between two photos.
TEST(WeakestCut, OfAHingeItIsTheHinge) {
  const SyntheticOptions options = Corridor();
  const Bundle bundle = BundleAtTruth(options, RoundCorridor(options, 72, kNowhere));
  const auto center = [&](size_t i) {
    return Eigen::Vector3d(-(bundle.poses[i].R.transpose() * bundle.poses[i].t));
  };
  const Eigen::Vector3d hinge = 0.5 * (center(13) + center(14));
  std::vector<Eigen::Vector3d> displacements;
  for (size_t i = 0; i < bundle.poses.size(); ++i) {
    const Eigen::Vector3d turned = Eigen::Vector3d(0, 0.1, 0).cross(center(i) - hinge);
    displacements.push_back(i < 14 ? Eigen::Vector3d::Zero() : turned);
  }
  const WeakestCut cut = FindWeakestCut(bundle, MaximumSpanningTree(bundle), displacements);
  EXPECT_EQ(cut.loose, 14);
  EXPECT_EQ(cut.anchor, 13);
  EXPECT_EQ(cut.num_loose, 6);
  EXPECT_NEAR(cut.explained_share, 1, 1e-6);
}

void AddPoints(int num_points, const std::vector<int>& poses, Bundle* bundle) {
  for (int i = 0; i < num_points; ++i) {
    BundlePoint point;
    point.xyz.z() = 10;
    point.first = static_cast<int>(bundle->observations.size());
    point.count = static_cast<int>(poses.size());
    bundle->points.push_back(point);
    for (const int pose : poses) {
      bundle->observations.emplace_back();
      bundle->observations.back().pose = pose;
    }
  }
}

void AddPoseAt(double x, Bundle* bundle) {
  BundlePose pose;
  pose.t.x() = -x;
  bundle->poses.push_back(pose);
}

// Poses 0 to 3 and 4 to 5 observe points of their own.
Bundle TwoParts() {
  Bundle bundle;
  for (const double x : {0, 1, 2, 3, 4, 5}) AddPoseAt(x, &bundle);
  AddPoints(100, {0, 1, 2, 3}, &bundle);
  AddPoints(50, {4, 5}, &bundle);
  return bundle;
}

// The tie is what both sides observe, not what the two poses at the cut do. Points of two poses
// leave the scale free.
TEST(ThinnestCut, CountsWhatTiesTheSides) {
  Bundle bundle = TwoParts();
  AddPoints(12, {2, 3, 4}, &bundle);
  AddPoints(5, {0, 1, 5}, &bundle);
  AddPoints(40, {3, 4}, &bundle);
  const auto cut = FindThinnestCut(bundle, MaximumSpanningTree(bundle), 30);
  ASSERT_TRUE(cut);
  EXPECT_EQ(cut->loose, 4);
  EXPECT_EQ(cut->anchor, 3);
  EXPECT_EQ(cut->loose_side, std::vector<int>({4, 5}));
  EXPECT_EQ(cut->num_points, 17);
  AddPoints(13, {2, 4, 5}, &bundle);
  EXPECT_FALSE(FindThinnestCut(bundle, MaximumSpanningTree(bundle), 30));
}

// South-building, each photo with a smaller copy: 17 % of the extent wrong.
TEST(ThinnestCut, CopiesOfAPhotoTieNothing) {
  Bundle bundle = TwoParts();
  AddPoseAt(3, &bundle);
  AddPoints(100, {2, 3, 6}, &bundle);
  AddPoints(40, {3, 6, 4}, &bundle);
  const auto cut = FindThinnestCut(bundle, MaximumSpanningTree(bundle), 30);
  ASSERT_TRUE(cut);
  EXPECT_EQ(cut->loose_side, std::vector<int>({4, 5}));
  EXPECT_EQ(cut->num_points, 0);
}

// Two photos with a copy each: neither side has a scale of its own.
TEST(ThinnestCut, CopiesAreNoSide) {
  Bundle bundle;
  for (const double x : {0, 0, 1, 1}) AddPoseAt(x, &bundle);
  AddPoints(100, {0, 1, 2, 3}, &bundle);
  AddPoints(100, {0, 1}, &bundle);
  AddPoints(100, {2, 3}, &bundle);
  EXPECT_FALSE(FindThinnestCut(bundle, MaximumSpanningTree(bundle), 30));
}

TEST(ThinnestCut, CutsWhereNothingIsShared) {
  const Bundle bundle = TwoParts();
  const auto cut = FindThinnestCut(bundle, MaximumSpanningTree(bundle), 30);
  ASSERT_TRUE(cut);
  EXPECT_EQ(cut->loose_side, std::vector<int>({4, 5}));
  EXPECT_EQ(cut->num_points, 0);
}

TEST(ThinnestCut, OfASinglePoseThereIsNone) {
  Bundle bundle = TwoParts();
  AddPoints(40, {2, 3, 4}, &bundle);
  AddPoseAt(6, &bundle);
  AddPoints(10, {0, 6}, &bundle);
  EXPECT_FALSE(FindThinnestCut(bundle, MaximumSpanningTree(bundle), 30));
}

}  // namespace skein::loosest_mode_test
