#include "benchmark/surface_distance.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>

namespace skein::surface_distance_test {

// The square [0, 2] x [0, 2] in z = 0 and a triangle in x = 10.
SurfaceDistance SquareAndTriangle() {
  const std::string file = testing::TempDir() + "surface_distance_test.ply";
  std::ofstream(file) << "ply\nformat ascii 1.0\nelement vertex 7\nproperty float x\n"
                         "property float y\nproperty float z\nelement face 2\n"
                         "property list uchar int vertex_indices\nend_header\n"
                         "0 0 0\n2 0 0\n2 2 0\n0 2 0\n10 0 0\n10 2 0\n10 1 2\n"
                         "4 0 1 2 3\n3 4 5 6\n";
  const SurfaceDistance distance(file);
  std::remove(file.c_str());
  return distance;
}

TEST(SurfaceDistance, IsPerpendicularAboveAFace) {
  const SurfaceDistance distance = SquareAndTriangle();
  EXPECT_NEAR(distance({0.5, 1.5, 0.3}), 0.3, 1e-12);
  EXPECT_NEAR(distance({1.5, 0.5, -0.3}), 0.3, 1e-12);
  EXPECT_NEAR(distance({9.5, 1, 1}), 0.5, 1e-12);
  EXPECT_NEAR(distance({1, 1, 0}), 0, 1e-12);
}

TEST(SurfaceDistance, IsToTheEdgeOrCornerBesideAFace) {
  const SurfaceDistance distance = SquareAndTriangle();
  EXPECT_NEAR(distance({1, -3, 4}), 5, 1e-12);
  EXPECT_NEAR(distance({-1, -2, 2}), 3, 1e-12);
  EXPECT_NEAR(distance({10, 1, 5}), 3, 1e-12);
}

TEST(SurfaceDistance, RefusesWhatIsNoMesh) {
  EXPECT_THROW(SurfaceDistance("/does/not/exist.ply"), std::runtime_error);
}

}  // namespace skein::surface_distance_test
