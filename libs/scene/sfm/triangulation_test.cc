#include "sfm/triangulation.h"

#include <gtest/gtest.h>

#include "core/angles.h"
#include "sfm/pose.h"
#include "sfm/reprojection.h"

namespace skein::triangulation_test {

// Cameras on a line, one metre apart, that look along z.
class Views {
 public:
  explicit Views(int count, const Eigen::Vector3d& point) {
    camera_.InitializeWithName("SIMPLE_PINHOLE", 500, 640, 480);
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d center(i, 0, 0);
      const Eigen::Vector2d on_plane = (point - center).hnormalized();
      views.push_back(
          {camera_.WorldToImage(on_plane), on_plane,
           ComposeProjectionMatrix(Eigen::Matrix3d(Eigen::Matrix3d::Identity()), -center), center,
           &camera_});
    }
  }

  void Spoil(size_t i) {
    views[i].on_plane.y() += 0.3;
    views[i].pixel = camera_.WorldToImage(views[i].on_plane);
  }

  std::vector<TriangulationView> views;

 private:
  Camera camera_;
};

TEST(Triangulation, TwoRaysMeetInThePoint) {
  const Eigen::Vector3d point(0.3, -0.2, 5);
  const Views seen(2, point);
  EXPECT_LT((TriangulatePoint(seen.views[0].cam_from_world, seen.views[1].cam_from_world,
                              seen.views[0].on_plane, seen.views[1].on_plane) -
             point)
                .norm(),
            1e-9);
}

TEST(Triangulation, TheAngleIsThatBetweenTheRays) {
  EXPECT_NEAR(RadToDeg(CalculateTriangulationAngle({-1, 0, 0}, {1, 0, 0}, {0, 0, 1})), 90, 1e-9);
  EXPECT_NEAR(RadToDeg(CalculateTriangulationAngle({-1, 0, 0}, {1, 0, 0}, {0, 0, 0})), 0, 1e-6);
  EXPECT_EQ(CalculateTriangulationAngle({1, 0, 0}, {0, 0, 0}, {1, 0, 0}), 0);
}

TEST(Triangulation, LeavesViewsOutThatDoNotFit) {
  const Eigen::Vector3d point(0.3, -0.2, 5);
  for (const auto error :
       {TriangulationLimits::Error::kAngle, TriangulationLimits::Error::kReprojection}) {
    Views seen(6, point);
    seen.Spoil(2);
    TriangulationLimits limits;
    limits.error = error;
    limits.max_error = error == TriangulationLimits::Error::kAngle ? DegToRad(2.0) : 4;
    Eigen::Vector3d xyz;
    std::vector<char> inliers;
    ASSERT_TRUE(EstimateTriangulation(limits, seen.views, &inliers, &xyz));
    EXPECT_LT((xyz - point).norm(), 1e-9);
    EXPECT_EQ(inliers, (std::vector<char>{1, 1, 0, 1, 1, 1}));
  }
}

TEST(Triangulation, FindsNothingUnderTooSmallAnAngle) {
  const Views seen(3, {0, 0, 5000});
  TriangulationLimits limits;
  limits.max_error = DegToRad(2.0);
  Eigen::Vector3d xyz;
  std::vector<char> inliers;
  EXPECT_FALSE(EstimateTriangulation(limits, seen.views, &inliers, &xyz));
}

TEST(Triangulation, APointBehindTheCameraHasTheLargestError) {
  Camera camera;
  camera.InitializeWithName("SIMPLE_PINHOLE", 500, 640, 480);
  const Eigen::Vector3d behind(0, 0, -1);
  EXPECT_EQ(CalculateSquaredReprojectionError({320, 240}, behind, Eigen::Vector4d(1, 0, 0, 0),
                                              Eigen::Vector3d(0, 0, 0), camera),
            std::numeric_limits<double>::max());
  EXPECT_NEAR(CalculateSquaredReprojectionError({323, 244}, {0, 0, 2}, Eigen::Vector4d(1, 0, 0, 0),
                                                Eigen::Vector3d(0, 0, 0), camera),
              25, 1e-9);
}

}  // namespace skein::triangulation_test
