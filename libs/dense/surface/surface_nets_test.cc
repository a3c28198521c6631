#include "surface/surface_nets.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "testing/wall_maps.h"

namespace skein::surface_test {
namespace {

constexpr double kNetVoxel = 0.08;

SurfaceMesh MeshOfMaps(const std::vector<WallMap>& maps) {
  SurfaceOptions options;
  options.voxel = kNetVoxel;
  SurfaceVolume volume(options);
  for (const WallMap& map : maps) EXPECT_TRUE(volume.Add(map.Coloured()).ok());
  return MeshOf(volume);
}

const std::vector<WallMap>& ThreeMaps() {
  static const std::vector<WallMap> maps = {WallMap(PoseAt({0, 0, 0})),
                                            WallMap(PoseAt({1.3, 0.4, 0.2}, 0.1, 0.3)),
                                            WallMap(PoseAt({-1, 1, 0}, -0.1))};
  return maps;
}

Eigen::Vector3d PositionOf(const SurfaceMesh& mesh, uint32_t vertex) {
  return mesh.Position(mesh.vertices[vertex]);
}

TEST(SurfaceNets, AWallIsFlat) {
  const SurfaceMesh mesh = MeshOfMaps(ThreeMaps());
  // 10.7 x 8 units at the distance of the wall are seen by each photo.
  EXPECT_GT(mesh.vertices.size(), 80 / (kNetVoxel * kNetVoxel));
  EXPECT_LT(mesh.vertices.size(), 4 * 80 / (kNetVoxel * kNetVoxel));
  double sum = 0;
  for (uint32_t i = 0; i < mesh.vertices.size(); ++i) {
    const double distance = DistanceFromWall(PositionOf(mesh, i));
    ASSERT_LT(distance, kNetVoxel) << PositionOf(mesh, i).transpose();
    sum += distance;
  }
  EXPECT_LT(sum / static_cast<double>(mesh.vertices.size()), kNetVoxel / 10);
}

// As the ground some metres ahead of a camera that is held level: courtyard lost most of it.
TEST(SurfaceNets, AWallThatIsSeenAtAGrazingAngleIsFlat) {
  Wall wall;
  wall.camera = {640, 480, {600, 600}, {320, 240}};
  const double degree = std::acos(-1.0) / 180;
  const Eigen::Vector3d centre(0, 0, wall.distance - std::hypot(1, wall.slope));  // 1 from the wall
  const Eigen::Vector3d along = Eigen::Vector3d(1, 0, wall.slope).normalized();
  WallMap map(PoseAt(centre, std::atan(wall.slope) - 84 * degree));
  map.map = wall.Map(map.map.cam_from_world, 0.02f);
  map.colours = cv::Mat3b(map.map.depth.size(), kWallColour);
  const SurfaceMesh mesh = MeshOfMaps({map});
  int num_ahead = 0;
  for (uint32_t i = 0; i < mesh.vertices.size(); ++i) {
    const double ahead = (PositionOf(mesh, i) - centre).dot(along);
    if (ahead < std::tan(82 * degree) || ahead > std::tan(85 * degree)) continue;
    ASSERT_LT(DistanceFromWall(PositionOf(mesh, i)), kNetVoxel);
    ++num_ahead;
  }
  EXPECT_GT(num_ahead, 2000);
}

TEST(SurfaceNets, NormalsAndTrianglesFaceTheCameras) {
  const SurfaceMesh mesh = MeshOfMaps(ThreeMaps());
  double least = 1;
  for (const MeshVertex& vertex : mesh.vertices) {
    least = std::min(least, vertex.normal.cast<double>().dot(WallNormal()));
    ASSERT_EQ(vertex.colour, (std::array<uint8_t, 3>{30, 20, 10}));
  }
  EXPECT_GT(least, 0.8);
  double front = 0, back = 0;  // areas
  for (size_t i = 0; i < mesh.indices.size(); i += 3) {
    const Eigen::Vector3d a = PositionOf(mesh, mesh.indices[i]),
                          b = PositionOf(mesh, mesh.indices[i + 1]),
                          c = PositionOf(mesh, mesh.indices[i + 2]);
    const double area = (b - a).cross(c - a).dot(WallNormal()) / 2;
    (area > 0 ? front : back) += std::abs(area);
  }
  EXPECT_GT(front, 80);
  EXPECT_LT(back, front / 1000) << "slivers alone";
}

TEST(SurfaceNets, TrianglesShareTheirEdges) {
  const SurfaceMesh mesh = MeshOfMaps(ThreeMaps());
  std::map<std::pair<uint32_t, uint32_t>, int> edges;
  for (size_t i = 0; i < mesh.indices.size(); i += 3) {
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t a = mesh.indices[i + k], b = mesh.indices[i + (k + 1) % 3];
      ASSERT_LT(a, mesh.vertices.size());
      ++edges[std::minmax(a, b)];
    }
  }
  size_t inner = 0;
  for (const auto& [edge, count] : edges) {
    ASSERT_LE(count, 2);
    inner += count == 2;
  }
  EXPECT_GT(inner, edges.size() * 95 / 100);
}

TEST(SurfaceNets, AHoleStaysAHole) {
  WallMap map(PoseAt({0, 0, 0}));
  const cv::Rect hole(60, 40, 40, 30);
  map.map.depth(hole) = 0;
  const SurfaceMesh mesh = MeshOfMaps({map});
  const cv::Rect2d inside(hole.x + 2, hole.y + 2, hole.width - 4, hole.height - 4);
  int beside = 0;
  for (uint32_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector2d pixel = map.map.camera.Pixel(PositionOf(mesh, i).hnormalized());
    ASSERT_FALSE(inside.contains({pixel.x(), pixel.y()})) << pixel.transpose();
    ASSERT_LT(DistanceFromWall(PositionOf(mesh, i)), kNetVoxel);
    beside += pixel.x() < hole.x;
  }
  EXPECT_GT(beside, 1000);
}

TEST(SurfaceNets, CubesTogetherHaveTheTrianglesOfTheWhole) {
  SurfaceOptions options;
  options.voxel = kNetVoxel;
  SurfaceVolume volume(options);
  ASSERT_TRUE(volume.Add(ThreeMaps()[0].Coloured()).ok());
  constexpr int kSide = 4;
  std::set<BlockIndex> cubes;
  const auto below = [](int i) { return kSide * ((i - (i < 0 ? kSide - 1 : 0)) / kSide); };
  for (const BlockIndex& block : volume.Blocks()) {
    cubes.insert({below(block.x), below(block.y), below(block.z)});
  }
  ASSERT_GT(cubes.size(), 4u);
  const auto area = [](const SurfaceMesh& mesh) {
    double sum = 0;
    for (size_t i = 0; i < mesh.indices.size(); i += 3) {
      const Eigen::Vector3d a = PositionOf(mesh, mesh.indices[i]);
      sum += (PositionOf(mesh, mesh.indices[i + 1]) - a)
                 .cross(PositionOf(mesh, mesh.indices[i + 2]) - a)
                 .norm();
    }
    return sum / 2;
  };
  int64_t num_triangles = 0;
  double sum = 0;
  for (const BlockIndex& cube : cubes) {
    const SurfaceMesh part = MeshOfCube(volume, cube, kSide);
    num_triangles += part.NumTriangles();
    sum += area(part);
    std::set<uint32_t> used(part.indices.begin(), part.indices.end());
    EXPECT_EQ(used.size(), part.vertices.size());
  }
  const SurfaceMesh whole = MeshOf(volume);
  EXPECT_EQ(num_triangles, whole.NumTriangles());
  EXPECT_NEAR(sum, area(whole), 1e-3 * sum);
}

TEST(SurfaceNets, AnEmptyVolumeHasNoMesh) {
  const SurfaceMesh mesh = MeshOfMaps({});
  EXPECT_TRUE(mesh.vertices.empty());
  EXPECT_EQ(mesh.NumTriangles(), 0);
}

}  // namespace
}  // namespace skein::surface_test
