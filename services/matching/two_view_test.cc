#include "matching/two_view.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "sfm/random.h"
#include "testing/synthetic_scene.h"
#include "testing/test_random.h"

namespace skein::two_view_test {

using Points = std::vector<Eigen::Vector2d>;

constexpr double kFocalPx = 1200;
constexpr int kWidthPx = 1600, kHeightPx = 1200;

// Two photos with their matches, of which the last are false.
struct Scene {
  Points points1, points2;
  FeatureMatches matches;
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  // camera 2 from camera 1
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
};

Points PixelsOf(const PhotoInput& photo) {
  Points pixels;
  for (const Keypoint& keypoint : photo.keypoints) pixels.emplace_back(keypoint.x, keypoint.y);
  return pixels;
}

class TwoView : public testing::Test {
 protected:
  Eigen::Vector2d RandomPixel() {
    const double x = Uniform(0, kWidthPx, &random_);
    return {x, Uniform(0, kHeightPx, &random_)};
  }

  // Points in front of camera 1 are a plane, or deep. False matches are of clutter.
  Scene MakeScene(int num_true, int num_false, const Eigen::Vector3d& t, bool planar) {
    Scene scene;
    scene.t = t;
    scene.R = Eigen::AngleAxisd(0.1, Eigen::Vector3d(0.2, 1, 0.1).normalized()).matrix();
    SyntheticScene place;
    for (int i = 0; i < 2 * num_true; ++i) {  // camera 2 may not see them all
      const double depth = planar ? 8 : Uniform(4, 12, &random_);
      const double x = Uniform(-0.5, 0.5, &random_);
      place.points.push_back(depth * Eigen::Vector3d(x, Uniform(-0.4, 0.4, &random_), 1));
    }
    place.AddPose(Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero());
    place.AddPose(scene.R, -(scene.R.transpose() * t));
    SyntheticOptions options;
    options.camera.width_px = kWidthPx;
    options.camera.height_px = kHeightPx;
    options.camera.focal_px = kFocalPx;
    options.num_clutter = num_false;
    Photograph(options, &random_, &place);
    scene.points1 = PixelsOf(place.photos[0]);
    scene.points2 = PixelsOf(place.photos[1]);
    for (int i = 0; i < num_true; ++i) {
      const auto& [point2, point1] = place.pairs.at(1).at(0).inliers.at(i);
      scene.matches.emplace_back(point1, point2);
    }
    for (int i = 1; i <= num_false; ++i) {
      scene.matches.emplace_back(scene.points1.size() - i, scene.points2.size() - i);
    }
    return scene;
  }

  TwoViewGeometry Estimate(const Scene& scene, bool prior = true) {
    const Camera camera = PriorCamera(kWidthPx, kHeightPx, kFocalPx, prior);
    return EstimateTwoView(camera, scene.points1, camera, scene.points2, scene.matches, 5);
  }

  std::mt19937 random_{42};
};

TEST_F(TwoView, FindsPoseOfCalibratedPair) {
  const Scene scene = MakeScene(200, 100, Eigen::Vector3d(-1, 0.1, 0.1), false);
  const TwoViewGeometry geometry = Estimate(scene);
  EXPECT_EQ(geometry.config, TwoViewGeometry::CALIBRATED);
  EXPECT_TRUE(IsVerified(geometry));
  EXPECT_GE(geometry.inlier_matches.size(), 195u);
  EXPECT_LE(geometry.inlier_matches.size(), 215u);
  EXPECT_GT(geometry.tvec.dot(scene.t.normalized()), 0.999);
  const Eigen::Vector4d& q = geometry.qvec;
  const Eigen::Quaterniond rotation(q(0), q(1), q(2), q(3));
  EXPECT_LT(rotation.angularDistance(Eigen::Quaterniond(scene.R)), 0.01);
  EXPECT_GT(geometry.tri_angle, 0.05);
  EXPECT_NEAR(ForwardMotion(geometry), 0.1, 0.05);
}

TEST_F(TwoView, SeesForwardMotion) {
  const Scene scene = MakeScene(200, 20, Eigen::Vector3d(0, 0, -2), false);
  EXPECT_GT(ForwardMotion(Estimate(scene)), 0.95);
}

TEST_F(TwoView, FindsPoseFromFundamentalMatrixWithoutPriors) {
  const Scene scene = MakeScene(200, 60, Eigen::Vector3d(-1, 0.1, 0.1), false);
  const TwoViewGeometry geometry = Estimate(scene, false);
  EXPECT_EQ(geometry.config, TwoViewGeometry::UNCALIBRATED);
  EXPECT_GT(std::abs(geometry.tvec.dot(scene.t.normalized())), 0.98);
  EXPECT_GT(geometry.tri_angle, 0.05);
}

TEST_F(TwoView, RecognisesPlane) {
  const Scene scene = MakeScene(200, 60, Eigen::Vector3d(-1, 0.1, 0.1), true);
  EXPECT_EQ(Estimate(scene).config, TwoViewGeometry::PLANAR);
}

// Of a camera whose focal length is not known: the pair's homography is taken apart with a wrong
// one.
TEST_F(TwoView, PureRotationIsKnownWithoutFocalPrior) {
  const Scene scene = MakeScene(200, 60, Eigen::Vector3d::Zero(), false);
  for (const double factor : {0.7, 1.0, 1.5}) {
    const Camera camera = PriorCamera(kWidthPx, kHeightPx, factor * kFocalPx, false);
    const TwoViewGeometry geometry =
        EstimateTwoView(camera, scene.points1, camera, scene.points2, scene.matches, 5);
    EXPECT_EQ(geometry.config, TwoViewGeometry::PANORAMIC) << factor;
    EXPECT_EQ(geometry.tri_angle, 0) << factor;
    EXPECT_TRUE(IsVerified(geometry)) << factor;
  }
}

TEST_F(TwoView, AWallBeforeAMovingCameraIsNoRotationWithoutFocalPrior) {
  const Scene scene = MakeScene(200, 60, Eigen::Vector3d(-1, 0.1, 0.1), true);
  for (const double factor : {0.7, 1.0, 1.5}) {
    const Camera camera = PriorCamera(kWidthPx, kHeightPx, factor * kFocalPx, false);
    EXPECT_GT(
        EstimateTwoView(camera, scene.points1, camera, scene.points2, scene.matches, 5).tri_angle,
        0.01)
        << factor;
  }
}

TEST_F(TwoView, PureRotationHasNoTriangulationAngle) {
  const Scene scene = MakeScene(200, 60, Eigen::Vector3d::Zero(), false);
  const TwoViewGeometry geometry = Estimate(scene);
  EXPECT_TRUE(geometry.config == TwoViewGeometry::PANORAMIC ||
              geometry.config == TwoViewGeometry::PLANAR);
  EXPECT_LT(geometry.tri_angle, 0.02);
}

TEST_F(TwoView, RecognisesWatermark) {
  Scene scene;
  for (int i = 0; i < 60; ++i) {
    scene.points1.push_back(Uniform3(20, 150, &random_).head<2>());
    scene.points2.push_back(scene.points1.back());
    scene.matches.emplace_back(i, i);
  }
  const TwoViewGeometry geometry = Estimate(scene);
  EXPECT_EQ(geometry.config, TwoViewGeometry::WATERMARK);
  EXPECT_FALSE(IsVerified(geometry));
}

// These draws: of 60 others of 100 matches, 14 are verified.
TEST_F(TwoView, RefusesRandomMatches) {
  for (const int n : {15, 40, 100}) {
    Scene scene;
    for (int i = 0; i < n; ++i) {
      scene.points1.push_back(RandomPixel());
      scene.points2.push_back(RandomPixel());
      scene.matches.emplace_back(i, i);
    }
    EXPECT_FALSE(IsVerified(Estimate(scene))) << n;
  }
}

// 80 of 500 matches: too few for samples of all.
TEST_F(TwoView, FindsTheGeometryOfTheSurestMatches) {
  Scene scene = MakeScene(80, 420, Eigen::Vector3d(-1, 0.1, 0.1), false);
  std::shuffle(scene.matches.begin(), scene.matches.begin() + 120, random_);
  for (const bool prior : {true, false}) {
    const TwoViewGeometry geometry = Estimate(scene, prior);
    EXPECT_TRUE(IsVerified(geometry));
    EXPECT_GE(geometry.inlier_matches.size(), 78u);
    EXPECT_LE(geometry.inlier_matches.size(), 110u);
  }
}

TEST_F(TwoView, RefusesTooFewMatches) {
  EXPECT_FALSE(IsVerified(Estimate(MakeScene(14, 0, Eigen::Vector3d(-1, 0, 0), false))));
  EXPECT_FALSE(IsVerified(Estimate(Scene())));
}

TEST_F(TwoView, StaysFiniteWhenAllMatchesCoincide) {
  Scene scene;
  for (int i = 0; i < 50; ++i) {
    scene.points1.emplace_back(800, 600);
    scene.points2.emplace_back(900, 500);
    scene.matches.emplace_back(i, i);
  }
  const TwoViewGeometry geometry = Estimate(scene);
  EXPECT_TRUE(geometry.qvec.allFinite());
  EXPECT_TRUE(geometry.tvec.allFinite());
  EXPECT_TRUE(std::isfinite(geometry.tri_angle));
}

TEST_F(TwoView, RefusesBrokenInput) {
  Scene scene = MakeScene(30, 0, Eigen::Vector3d(-1, 0, 0), false);
  scene.matches.emplace_back(3, scene.points2.size());
  EXPECT_THROW(Estimate(scene), std::invalid_argument);
  EXPECT_THROW(PriorCamera(0, 5, 100, true), std::invalid_argument);
  EXPECT_THROW(PriorCamera(5, 5, std::nan(""), true), std::invalid_argument);
}

TEST_F(TwoView, IsDeterministic) {
  const Scene scene = MakeScene(60, 60, Eigen::Vector3d(-1, 0.1, 0.1), false);
  const TwoViewGeometry a = Estimate(scene), b = Estimate(scene);
  EXPECT_EQ(a.E, b.E);
  EXPECT_EQ(a.F, b.F);
  EXPECT_EQ(a.H, b.H);
  EXPECT_EQ(a.tvec, b.tvec);
}

TwoViewGeometry EstimateByColmap(const Scene& scene, bool prior) {
  const Camera camera = PriorCamera(kWidthPx, kHeightPx, kFocalPx, prior);
  RansacLimits limits;
  limits.max_error = 4;
  limits.confidence = 0.999;
  limits.min_inlier_ratio = 0.25;
  limits.max_num_trials = 10000;
  SetRandomSeed(5);
  return skein::EstimateByColmap({camera, scene.points1, camera, scene.points2}, scene.matches,
                                 limits);
}

// A random match may be an inlier of one model and not of the other.
TEST_F(TwoView, OneSearchDecidesAsColmap) {
  for (const bool prior : {true, false}) {
    for (const bool planar : {true, false}) {
      for (const int num_false : {0, 30, 150}) {
        const Scene scene = MakeScene(100, num_false, Eigen::Vector3d(-1, 0.1, 0.1), planar);
        const TwoViewGeometry ours = Estimate(scene, prior);
        const TwoViewGeometry expected = EstimateByColmap(scene, prior);
        EXPECT_EQ(ours.config, expected.config) << prior << planar << num_false;
        EXPECT_GE(ours.inlier_matches.size(), 98u);
        EXPECT_NEAR(ours.inlier_matches.size(), expected.inlier_matches.size(), 6);
        if (prior && !planar) {
          EXPECT_LT((ours.tvec - expected.tvec).norm(), 0.02);
          EXPECT_NEAR(ours.tri_angle, expected.tri_angle, 0.2 * expected.tri_angle);
        }
      }
    }
  }
}

// Without the true focal length E explains less than F, which the search for E has to lead to.
TEST_F(TwoView, FindsFundamentalMatrixWhereThePriorIsWrong) {
  const Scene scene = MakeScene(300, 30, Eigen::Vector3d(-1, 0.4, 0.6), false);
  const Camera camera = PriorCamera(kWidthPx, kHeightPx, 1.6 * kFocalPx, true);
  const TwoViewGeometry geometry =
      EstimateTwoView(camera, scene.points1, camera, scene.points2, scene.matches, 5);
  EXPECT_TRUE(IsVerified(geometry));
  EXPECT_GE(geometry.inlier_matches.size(), 290u);
}

}  // namespace skein::two_view_test
