#include "sfm/two_view_geometry.h"

#include <gtest/gtest.h>

#include <random>

#include "core/angles.h"
#include "sfm/pose.h"
#include "sfm/random.h"
#include "testing/test_random.h"

namespace skein::two_view_geometry_test {

// Random points before two cameras, the second turned and moved to the right.
class TwoViews {
 public:
  explicit TwoViews(const Eigen::Vector3d& t, bool coplanar = false) : t_(t) {
    camera_.InitializeWithName("SIMPLE_PINHOLE", 500, 640, 480);
    for (Point2DIdx i = 0; i < 200; ++i) {
      Eigen::Vector3d point = Uniform3(-1, 1, &random_) + Eigen::Vector3d(0, 0, 5);
      if (coplanar) point.z() = 5 + 0.2 * point.x();
      points1_.push_back(camera_.WorldToImage(point.hnormalized()));
      points2_.push_back(camera_.WorldToImage((R_ * point + t_).hnormalized()));
      matches.emplace_back(i, i);
    }
  }

  ImagePair Pair() const { return {camera_, points1_, camera_, points2_}; }
  TwoViewGeometry Estimate() const {
    RansacLimits limits;
    limits.max_error = 4;
    limits.confidence = 0.999;
    limits.min_inlier_ratio = 0.25;
    limits.max_num_trials = 2000;
    SetRandomSeed(1);
    return EstimateCalibrated(Pair(), matches, limits);
  }
  double RotationError(const TwoViewGeometry& geometry) const {
    return Eigen::AngleAxisd(QuaternionToRotationMatrix(geometry.qvec) * R_.transpose()).angle();
  }

  FeatureMatches matches;

 private:
  std::mt19937 random_{5};
  const Eigen::Matrix3d R_ = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY()).matrix();
  const Eigen::Vector3d t_;
  Camera camera_;
  std::vector<Eigen::Vector2d> points1_, points2_;
};

TEST(TwoViewGeometry, RecoversThePose) {
  const TwoViews views({-1, 0, 0});
  TwoViewGeometry geometry = views.Estimate();
  ASSERT_EQ(geometry.config, TwoViewGeometry::CALIBRATED);
  EXPECT_EQ(geometry.inlier_matches.size(), 200u);
  ASSERT_TRUE(EstimateRelativePose(views.Pair(), &geometry));
  EXPECT_LT(views.RotationError(geometry), 1e-4);
  EXPECT_LT((geometry.tvec - Eigen::Vector3d(-1, 0, 0)).norm(), 1e-3);
  EXPECT_GT(RadToDeg(geometry.tri_angle), 5);
}

TEST(TwoViewGeometry, TellsARotationFromAPlane) {
  TwoViewGeometry rotated = TwoViews({0, 0, 0}).Estimate();
  ASSERT_EQ(rotated.config, TwoViewGeometry::PLANAR_OR_PANORAMIC);
  const TwoViews plane({-1, 0, 0}, true);
  TwoViewGeometry planar = plane.Estimate();
  ASSERT_EQ(planar.config, TwoViewGeometry::PLANAR_OR_PANORAMIC);
  ASSERT_TRUE(EstimateRelativePose(plane.Pair(), &planar));
  EXPECT_EQ(planar.config, TwoViewGeometry::PLANAR);
  EXPECT_GT(planar.tri_angle, 0);
}

TEST(TwoViewGeometry, HasNoPoseWithoutAModel) {
  const TwoViews views({-1, 0, 0});
  TwoViewGeometry geometry;
  geometry.config = TwoViewGeometry::DEGENERATE;
  geometry.inlier_matches = views.matches;
  EXPECT_FALSE(EstimateRelativePose(views.Pair(), &geometry));
}

}  // namespace skein::two_view_geometry_test
