#include "depth/inverse_planes.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

namespace skein {
namespace {

const Eigen::Vector3d kFloor(0, 0.7, 0.02), kWall(0.1, 0, 0.2);
const PlaneSearch kSearch{0.001, 0.2, 0.1, 200};

class Depths {
 public:
  void Add(int count, const Eigen::Vector3d& plane, double noise) {
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector2d ray(Random(), Random());
      depths_.push_back({ray, plane.dot(ray.homogeneous()) + noise * Random()});
    }
  }
  const std::vector<InverseDepth>& all() const { return depths_; }

 private:
  double Random() { return std::uniform_real_distribution<double>(-0.5, 0.5)(random_); }

  std::mt19937 random_{7};
  std::vector<InverseDepth> depths_;
};

TEST(FindPlanes, FindsTwoAmongOutliersTheLargerFirst) {
  Depths depths;
  depths.Add(80, kWall, 0.001);
  depths.Add(150, kFloor, 0.001);
  depths.Add(60, kFloor, 1);
  const FoundPlanes found = FindPlanes(depths.all(), kSearch);
  ASSERT_EQ(found.planes.size(), 2u);
  EXPECT_TRUE(found.planes[0].plane.isApprox(kFloor, 0.01));
  EXPECT_TRUE(found.planes[1].plane.isApprox(kWall, 0.01));
  EXPECT_NEAR(found.planes[0].on.size(), 150, 5);
  EXPECT_NEAR(found.left.size(), 60, 5);
}

TEST(FindPlanes, FindsNoneInNoise) {
  Depths depths;
  depths.Add(300, kFloor, 1);
  const FoundPlanes found = FindPlanes(depths.all(), kSearch);
  EXPECT_TRUE(found.planes.empty());
  EXPECT_EQ(found.left.size(), 300u);
}

TEST(FindPlanes, FindsNoneInNothing) {
  EXPECT_TRUE(FindPlanes({}, kSearch).planes.empty());
  EXPECT_TRUE(FindPlanes({{}, {}, {}, {}}, kSearch).planes.empty());
}

}  // namespace
}  // namespace skein
