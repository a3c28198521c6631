#include "depth/level_frame.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace skein::depth_test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Level frame: x right, y ahead, z up.
Matrix3d LookingDown() { return (Matrix3d() << 1, 0, 0, 0, -1, 0, 0, 0, -1).finished(); }
Matrix3d LookingAhead() { return (Matrix3d() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished(); }

// A model whose frame is turned and shifted against the level one.
const Eigen::Isometry3d kModelFromLevel =
    Eigen::Translation3d(3, -7, 11) * Eigen::AngleAxisd(2, Vector3d(1, -2, 0.5).normalized());

DepthPose InModel(const Matrix3d& rotation, const Vector3d& centre) {
  const Matrix3d turned = rotation * kModelFromLevel.linear().transpose();
  return {turned, -turned * (kModelFromLevel * centre)};
}

// 4 strips of 5, each back along the one before, with headings that alternate.
std::vector<DepthPose> FlightOver(const Matrix3d& rotation) {
  std::vector<DepthPose> cameras;
  for (int i = 0; i < 20; ++i) {
    const int strip = i / 5;
    const double angle = strip % 2 == 0 ? 0 : M_PI;
    const Matrix3d turned = rotation * Eigen::AngleAxisd(angle, Vector3d::UnitZ());
    cameras.push_back(InModel(turned, Vector3d(5 * (i % 5) - 10, 5 * strip - 7.5, 30)));
  }
  return cameras;
}

// Ground 60 x 30 around (0, 0, 0), and a share of points anywhere up to 10 above it.
std::vector<Vector3d> Site(double above, const Vector3d& slope = Vector3d::Zero()) {
  std::mt19937 random(7);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::vector<Vector3d> points;
  for (int i = 0; i < 5000; ++i) {
    Vector3d point(uniform(-30, 30), uniform(-15, 15), 0);
    point.z() = slope.dot(point) + (i < above * 5000 ? uniform(1, 10) : 0);
    points.push_back(kModelFromLevel * point);
  }
  return points;
}

double TiltDeg(const LevelFrame& frame) {
  const Matrix3d level_from_level = frame.level_from_model.linear() * kModelFromLevel.linear();
  return std::acos(std::min(1.0, level_from_level(2, 2))) * 180 / M_PI;
}

TEST(UpOfCameras, IsOppositeToTheViewFromAbove) {
  const Vector3d up = kModelFromLevel.linear().transpose() * UpOfCameras(FlightOver(LookingDown()));
  EXPECT_NEAR(up.z(), 1, 1e-9);
}

TEST(UpOfCameras, IsTheUpperSideOfPhotosThatAreHeldUpright) {
  const Vector3d up =
      kModelFromLevel.linear().transpose() * UpOfCameras(FlightOver(LookingAhead()));
  EXPECT_NEAR(up.z(), 1, 1e-9);
  EXPECT_EQ(UpOfCameras({}), Vector3d::UnitZ());
}

TEST(LevelFrame, TheGroundPlaneIsLevelAndAtZero) {
  const std::vector<Vector3d> site = Site(0.5);
  const LevelFrame frame = LevelFrameOf(FlightOver(LookingDown()), site);
  EXPECT_NEAR(frame.ground_share, 0.5, 0.05);
  EXPECT_NEAR(TiltDeg(frame), 0, 0.2);
  for (size_t i = 2500; i < site.size(); ++i) {
    ASSERT_NEAR((frame.level_from_model * site[i]).z(), 0, 0.1);
  }
  EXPECT_GT((frame.level_from_model * site[0]).z(), 0.9) << "up, not down";
}

TEST(LevelFrame, IsARotationThatKeepsLengths) {
  const LevelFrame frame = LevelFrameOf(FlightOver(LookingDown()), Site(0.5));
  const Matrix3d axes = frame.level_from_model.linear();
  EXPECT_TRUE((axes * axes.transpose()).isIdentity(1e-9));
  EXPECT_NEAR(axes.determinant(), 1, 1e-9);
}

TEST(LevelFrame, ItsXIsAlongTheLongerExtent) {
  const LevelFrame frame = LevelFrameOf(FlightOver(LookingAhead()), Site(0.2));
  const Matrix3d turn = frame.level_from_model.linear() * kModelFromLevel.linear();
  EXPECT_GT(std::abs(turn(0, 0)), 0.99);
}

TEST(LevelFrame, TheCamerasLookAhead) {
  const std::vector<DepthPose> cameras = {InModel(LookingAhead(), {0, -20, 2}),
                                          InModel(LookingAhead(), {5, -20, 2}),
                                          InModel(LookingAhead(), {-5, -22, 2})};
  const LevelFrame frame = LevelFrameOf(cameras, Site(0.2));
  const Matrix3d turn = frame.level_from_model.linear() * kModelFromLevel.linear();
  EXPECT_GT(turn(1, 1), 0.99);
}

TEST(LevelFrame, AGroundThatSlopesIsLevel) {
  const LevelFrame frame = LevelFrameOf(FlightOver(LookingDown()), Site(0, {0.2, 0, 0}));
  EXPECT_NEAR(frame.ground_share, 1, 1e-9);
  EXPECT_NEAR(TiltDeg(frame), std::atan(0.2) * 180 / M_PI, 1e-3);
}

TEST(LevelFrame, APlaneThatIsTooSteepIsNoGround) {
  const LevelFrame frame = LevelFrameOf(FlightOver(LookingDown()), Site(0, {2, 0, 0}));
  EXPECT_EQ(frame.ground_share, 0);
  EXPECT_NEAR(TiltDeg(frame), 0, 1e-3) << "up is that of the cameras";
}

TEST(LevelFrame, OfMapsIsThatOfTheirCamerasAndSomePoints) {
  const std::vector<DepthPose> cameras = FlightOver(LookingDown());
  std::vector<DensePoint> points;
  for (const Vector3d& point : Site(0)) {
    points.insert(points.end(), 10, {point, Eigen::Vector3f::UnitZ(), {}});
  }
  const std::vector<DensePoint> none;
  std::vector<DepthMap> maps(cameras.size());
  std::vector<ColouredMap> coloured;
  for (size_t i = 0; i < maps.size(); ++i) {
    maps[i].cam_from_world = cameras[i];
    coloured.push_back({&maps[i], nullptr, i == 1 ? &points : &none});
  }
  const LevelFrame frame = LevelFrameOf(coloured);
  EXPECT_NEAR(frame.ground_share, 1, 1e-9);
  EXPECT_NEAR(TiltDeg(frame), 0, 0.01);
}

TEST(LevelFrame, IsTheModelsWithoutPoints) {
  const LevelFrame frame = LevelFrameOf(FlightOver(LookingDown()), {});
  EXPECT_TRUE(frame.level_from_model.isApprox(Eigen::Isometry3d::Identity()));
  const LevelFrame of_one = LevelFrameOf(FlightOver(LookingDown()), {Vector3d(1, 2, 3)});
  EXPECT_TRUE(of_one.level_from_model.matrix().allFinite());
}

}  // namespace
}  // namespace skein::depth_test
