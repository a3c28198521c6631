#include "mapping/registration.h"

#include <gtest/gtest.h>

#include <random>

#include "base/pose.h"

namespace skein {
namespace {

constexpr double kFocalPx = 1000;

Eigen::Matrix3d TurnedBy(double degrees) {
  return Eigen::AngleAxisd(degrees * M_PI / 180, Eigen::Vector3d::UnitX()).toRotationMatrix();
}

// A small tilted plane far away: tilted the other way it looks nearly the same.
class TwoPoses : public testing::Test {
 protected:
  void SetUp() override {
    PhotoInput photo;
    photo.image_id = photo.camera_id = 1;
    photo.width_px = photo.height_px = 1000;
    photo.focal_px = kFocalPx;
    photo.focal_from_exif = true;
    ASSERT_TRUE(map_.AddPhoto(photo).ok());
    map_.SetCameraRefined(1, true);
    for (int i = 0; i < 100; ++i) {
      const Eigen::Vector3d xyz(uniform_(random_), uniform_(random_), 0);
      Add(xyz, right_, 0.1);
    }
  }

  // A point, and where a camera of this pose sees it.
  void Add(const Eigen::Vector3d& xyz, const Eigen::Matrix3d& R, double noise_px) {
    const Eigen::Vector2d pixel =
        (R * xyz + t_).hnormalized() * kFocalPx + Eigen::Vector2d(500, 500);
    visible_.point2D_idxs.push_back(static_cast<Point2DIdx>(visible_.size()));
    visible_.point3D_ids.push_back(visible_.size() + 1);
    visible_.pixels.push_back(pixel +
                              noise_px * Eigen::Vector2d(normal_(random_), normal_(random_)));
    visible_.xyz.push_back(xyz);
  }

  double RotationErrorDeg(const PoseEstimate& estimate) const {
    return Eigen::AngleAxisd(estimate.pose.R * right_.transpose()).angle() * 180 / M_PI;
  }

  const Eigen::Matrix3d right_ = TurnedBy(40), wrong_ = TurnedBy(-40);
  const Eigen::Vector3d t_{0, 0, 10};
  std::mt19937 random_{1};
  std::uniform_real_distribution<double> uniform_{-0.5, 0.5};
  std::normal_distribution<double> normal_;
  SceneMap map_;
  VisiblePoints visible_;
};

// A few mismatches beside the plane agree with the wrong pose, the plane's points do within 12 px.
TEST_F(TwoPoses, TheOneWithTheSmallerErrorsIsTakenNotTheOneWithMoreInliers) {
  for (int i = 0; i < 5; ++i) Add({0.1 * i, 0.05 * i, 1.0 + 0.1 * i}, wrong_, 0.1);
  RegistrationOptions only_wide;
  only_wide.ransac_limits_px = {only_wide.max_error_px};
  ASSERT_GT(RotationErrorDeg(EstimatePose(map_, 1, visible_, only_wide)), 60) << "no trap";
  const PoseEstimate estimate = EstimatePose(map_, 1, visible_, {});
  ASSERT_TRUE(estimate.ok) << estimate.reason;
  EXPECT_LT(RotationErrorDeg(estimate), 1);
  EXPECT_EQ(estimate.num_inliers, 100);
}

// A free pose and a held one, 2 units apart, that see the same points.
Bundle TwoViews(bool constant_points) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-2, 2);
  Bundle bundle;
  bundle.poses.resize(2);
  bundle.poses[1].t = Eigen::Vector3d(2, 0, 0);
  bundle.poses[1].constant = true;
  BundleCamera camera;
  camera.model_id = 0;  // SIMPLE_PINHOLE
  camera.params = {kFocalPx, 500, 500};
  camera.prior = camera.params;
  camera.prior_sigma = {0, 0, 0};
  bundle.cameras.push_back(camera);
  for (int i = 0; i < 50; ++i) {
    BundlePoint point;
    point.xyz = Eigen::Vector3d(uniform(random), uniform(random), 8 + uniform(random));
    point.constant = constant_points;
    point.first = 2 * i;
    point.count = 2;
    bundle.points.push_back(point);
    for (int k = 0; k < 2; ++k) {
      const Eigen::Vector3d seen = point.xyz + bundle.poses[k].t;
      bundle.observations.push_back(
          {k, static_cast<uint32_t>(i), seen.hnormalized() * kFocalPx + Eigen::Vector2d(500, 500)});
    }
  }
  return bundle;
}

TEST(PoseSigmas, CertainPointsAllAroundDetermineAPose) {
  const PoseSigmas sigmas = SigmasOfFirstPose(TwoViews(true));
  EXPECT_GT(sigmas.position, 0);
  EXPECT_LT(sigmas.position, 0.005);
  EXPECT_LT(sigmas.rotation_deg, 0.2);
}

// Matches between two photos say nothing of how far they are apart.
TEST(PoseSigmas, PointsTriangulatedWithOneOtherPhotoLeaveTheDistanceOpen) {
  EXPECT_GT(SigmasOfFirstPose(TwoViews(false)).position, 100);
}

TEST(PoseSigmas, OneCertainPointAmongThemClosesIt) {
  Bundle bundle = TwoViews(false);
  bundle.points[0].constant = true;
  EXPECT_LT(SigmasOfFirstPose(bundle).position, 0.02);
}

}  // namespace
}  // namespace skein
