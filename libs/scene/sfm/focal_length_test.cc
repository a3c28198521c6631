#include "sfm/focal_length.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "sfm/random.h"
#include "testing/test_random.h"

namespace skein::focal_length_test {

constexpr double kFocal = 1300;

// What a camera in general position sees of random points.
class SeenPoints {
 public:
  SeenPoints(int num_points, bool coplanar, double distortion = 0, double noise_px = 0) {
    pose_.leftCols<3>() = RandomRotation(&random_).toRotationMatrix();
    pose_.col(3) = Eigen::Vector3d(0.2, -0.1, 6);
    while (static_cast<int>(points.size()) < num_points) {
      Eigen::Vector3d point = Uniform3(-2, 2, &random_);
      if (coplanar) point.z() = 0.3 * point.x();
      const Eigen::Vector2d ray = (pose_ * point.homogeneous()).hnormalized();
      points.push_back(point);
      pixels.push_back(kFocal * (1 + distortion * ray.squaredNorm()) * ray +
                       Normal3(noise_px, &random_).head<2>());
    }
  }

  void SpoilEvery(int step) {
    for (size_t i = 0; i < pixels.size(); i += step) {
      pixels[i] = Uniform3(-600, 600, &random_).head<2>();
    }
  }

  double PoseError(const FocalPoseEstimator::M_t& model) const {
    return (model.cam_from_world - pose_).norm();
  }

  std::vector<Eigen::Vector2d> pixels;
  std::vector<Eigen::Vector3d> points;

 private:
  std::mt19937 random_{3};
  Eigen::Matrix<double, 3, 4> pose_;
};

class FivePoints : public testing::TestWithParam<bool> {};

TEST_P(FivePoints, OneOfThePosesIsTheRightOneWithItsFocalLength) {
  const SeenPoints seen(5, GetParam());
  const auto models = FocalPoseEstimator::Estimate(seen.pixels, seen.points);
  ASSERT_FALSE(models.empty());
  const auto best = std::min_element(
      models.begin(), models.end(),
      [&](const auto& a, const auto& b) { return seen.PoseError(a) < seen.PoseError(b); });
  EXPECT_LT(seen.PoseError(*best), 1e-6);
  EXPECT_NEAR(best->focal_px, kFocal, 1e-3);
}

TEST_P(FivePoints, EachPoseHasAllOfThemBeforeTheCameraAndARotation) {
  const SeenPoints seen(5, GetParam());
  for (const auto& model : FocalPoseEstimator::Estimate(seen.pixels, seen.points)) {
    const Eigen::Matrix3d R = model.cam_from_world.leftCols<3>();
    EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-9);
    EXPECT_NEAR(R.determinant(), 1, 1e-9);
    for (const Eigen::Vector3d& point : seen.points) {
      EXPECT_GT((model.cam_from_world * point.homogeneous()).z(), 0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Coplanar, FivePoints, testing::Bool());

TEST(FivePoints, OnALineGiveNoPoseThatIsNotFinite) {
  SeenPoints seen(5, false);
  for (int i = 0; i < 5; ++i) {
    seen.points[i] = Eigen::Vector3d(i, 0, 0);
    seen.pixels[i] = Eigen::Vector2d(100 * i, 0);
  }
  for (const auto& model : FocalPoseEstimator::Estimate(seen.pixels, seen.points)) {
    EXPECT_TRUE(model.cam_from_world.allFinite());
  }
}

RansacLimits Options() {
  RansacLimits options;
  options.max_error = 4;
  options.min_inlier_ratio = 0.25;
  options.min_num_trials = 100;
  options.max_num_trials = 10000;
  return options;
}

TEST(EstimateFocalLength, FindsItAmongFalseMatches) {
  SetRandomSeed(1);
  SeenPoints seen(300, false, -0.1, 0.5);
  seen.SpoilEvery(2);
  const std::optional<double> found = EstimateFocalLength(Options(), seen.pixels, seen.points);
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(*found, kFocal, 0.04 * kFocal);
}

TEST(EstimateFocalLength, FalseMatchesAloneHaveNone) {
  SetRandomSeed(1);
  SeenPoints seen(60, false);
  seen.SpoilEvery(1);
  EXPECT_FALSE(EstimateFocalLength(Options(), seen.pixels, seen.points).has_value());
}

}  // namespace skein::focal_length_test
