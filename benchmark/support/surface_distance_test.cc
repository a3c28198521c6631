#include "benchmark/support/surface_distance.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>

#include "texture/mesh_files.h"

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
  EXPECT_THROW(SurfaceDistance(PlyMesh{{{0, 0, 0}}, {}}), std::runtime_error);
}

TEST(SampleByArea, HasAsManyPointsAUnitOfArea) {
  const PlyMesh mesh{{{0, 0, 0}, {3, 0, 0}, {3, 1, 0}, {0, 1, 0}, {0, 0, 5}, {1, 0, 5}, {0, 2, 5}},
                     {{0, 1, 2, 3}, {4, 5, 6}}};
  const SurfaceDistance distance(mesh);
  int left = 0, right = 0, triangle = 0;
  for (const Eigen::Vector3d& sample : SampleByArea(mesh, 8000)) {
    EXPECT_NEAR(distance(sample), 0, 1e-12);
    ++(sample.z() > 1 ? triangle : sample.x() < 1.5 ? left : right);
  }
  for (const int half : {left / 3, right / 3, triangle / 2}) EXPECT_NEAR(half, 1000, 100);
}

// As `skein export --format mesh` writes it.
TEST(PlyMesh, ReadsABinaryMeshWithNormalsAndColours) {
  SurfaceMesh mesh;
  mesh.origin = {10, 0, 0};
  for (const auto& [x, y] : {std::pair{0, 0}, {2, 0}, {2, 1}, {0, 1}}) {
    mesh.vertices.push_back({Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), 0.5f),
                             Eigen::Vector3f::UnitZ(),
                             {255, 10, 13}});
  }
  mesh.indices = {0, 1, 2, 0, 2, 3};
  const std::string file = testing::TempDir() + "ply_mesh_test.ply", ply = MeshPly(mesh);
  std::ofstream(file, std::ios::binary) << ply;
  const PlyMesh read = ReadPlyMesh(file);
  EXPECT_EQ(read.faces, (std::vector<std::vector<uint32_t>>{{0, 1, 2}, {0, 2, 3}}));
  ASSERT_EQ(read.vertices.size(), 4U);
  EXPECT_EQ(read.vertices[2], Eigen::Vector3d(12, 1, 0.5));
  std::ofstream(file, std::ios::binary) << ply.substr(0, ply.size() - 1);
  EXPECT_THROW(ReadPlyMesh(file), std::runtime_error);
  std::remove(file.c_str());
}

}  // namespace skein::surface_distance_test
