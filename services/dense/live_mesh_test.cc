#include "dense/live_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "formats/mesh_chunk.h"
#include "surface/block.h"
#include "testing/wall_maps.h"

namespace skein::live_mesh_test {

using depth_test::PoseAt;
using surface_test::WallMap;

constexpr int64_t kSubmap = 3;
constexpr int64_t kUtimeUs = 1000;
// Ground sampling distance of the wall's photos.
constexpr double kPixel = 10 / 150.0;

LiveMeshOptions Enough() {
  LiveMeshOptions options;
  options.max_bytes = int64_t{1} << 30;
  return options;
}

ConfirmedMap MapAt(const DepthPose& pose, uint64_t revision = 1) {
  const WallMap wall(pose);
  return {wall.map, wall.colours, 1, revision};
}

std::map<uint32_t, ConfirmedMap> Maps(int count) {
  std::map<uint32_t, ConfirmedMap> maps;
  for (int i = 0; i < count; ++i) maps[i + 1] = MapAt(PoseAt({0.8 * i, 0, 0}), i + 1);
  return maps;
}

int Finish(LiveMesh* mesh) {
  int num_steps = 0;
  while (mesh->Step(kSubmap, kUtimeUs)) ++num_steps;
  return num_steps;
}

std::vector<Eigen::Vector3d> Vertices(const SubmapMesh& mesh) {
  std::vector<Eigen::Vector3d> vertices;
  for (const auto& [id, bytes] : mesh.blobs) {
    const Result<MeshChunk> chunk = DecodeMeshChunk(*bytes);
    EXPECT_TRUE(chunk.ok()) << chunk.error();
    if (!chunk.ok()) continue;
    for (const MeshChunk::Vertex& vertex : chunk->vertices) {
      vertices.push_back(Eigen::Vector3d::Map(chunk->origin.data()) +
                         chunk->step *
                             Eigen::Vector3d(vertex.xyz[0], vertex.xyz[1], vertex.xyz[2]));
    }
  }
  return vertices;
}

double MeanDistanceFromWall(const SubmapMesh& mesh, double scale = 1) {
  const std::vector<Eigen::Vector3d> vertices = Vertices(mesh);
  double sum = 0;
  for (const Eigen::Vector3d& vertex : vertices) {
    sum += surface_test::DistanceFromWall(vertex / scale);
  }
  return sum / static_cast<double>(vertices.size());
}

// Chunks without their versions.
std::set<Bytes> ContentsOf(const SubmapMesh& mesh) {
  std::set<Bytes> contents;
  for (const auto& [id, bytes] : mesh.blobs) {
    MeshChunk chunk = *DecodeMeshChunk(*bytes);
    chunk.version = 0;
    contents.insert(EncodeMeshChunk(chunk));
  }
  return contents;
}

TEST(LiveMesh, LiesOnTheWallThatTheMapsShow) {
  LiveMesh mesh(Enough());
  mesh.Update(kSubmap, Maps(3));
  Finish(&mesh);
  EXPECT_NEAR(mesh.VoxelOf(kSubmap), kPixel, 0.01);
  const SubmapMesh made = mesh.MeshOfSubmap(kSubmap);
  EXPECT_GT(made.list.chunks.size(), 4u);
  EXPECT_EQ(made.list.frame.size(), 3u);
  EXPECT_LT(MeanDistanceFromWall(made), kPixel / 10);
  for (const DenseManifest::Mesh::Chunk& chunk : made.list.chunks) {
    EXPECT_EQ(made.blobs.at(chunk.blob)->size(),
              MeshChunkBytes(chunk.num_vertices, chunk.num_triangles));
    EXPECT_LT(chunk.id, uint64_t{1} << 53) << "a browser's integers";
  }
}

TEST(LiveMesh, GrowsByChunksThatChanged) {
  LiveMesh mesh(Enough());
  std::map<uint32_t, ConfirmedMap> maps = Maps(2);
  mesh.Update(kSubmap, maps);
  Finish(&mesh);
  const SubmapMesh before = mesh.MeshOfSubmap(kSubmap);
  maps[3] = MapAt(PoseAt({9, 0, 0}), 3);
  mesh.Update(kSubmap, maps);
  Finish(&mesh);
  const SubmapMesh after = mesh.MeshOfSubmap(kSubmap);
  EXPECT_GT(after.list.chunks.size(), before.list.chunks.size());
  const auto num_same =
      std::count_if(before.blobs.begin(), before.blobs.end(),
                    [&](const auto& blob) { return after.blobs.count(blob.first) > 0; });
  EXPECT_GT(num_same, 0);
}

TEST(LiveMesh, NothingIsToDoWhereNothingChanged) {
  LiveMesh mesh(Enough());
  mesh.Update(kSubmap, Maps(2));
  EXPECT_GT(Finish(&mesh), 2);
  const uint64_t changes = mesh.changes();
  std::map<uint32_t, ConfirmedMap> maps = Maps(2);
  maps[1].map.cam_from_world.translation.x() += kPixel / 4;
  mesh.Update(kSubmap, maps);
  EXPECT_EQ(Finish(&mesh), 0) << "less than a voxel";
  EXPECT_EQ(mesh.changes(), changes);
}

TEST(LiveMesh, ASubmapThatIsLeftOutHasNoMeshAnyMore) {
  LiveMesh mesh(Enough());
  mesh.Update(kSubmap, Maps(2));
  Finish(&mesh);
  mesh.LeaveOut(kSubmap);
  mesh.Update(kSubmap, Maps(3));
  EXPECT_EQ(Finish(&mesh), 0);
  EXPECT_TRUE(mesh.MeshOfSubmap(kSubmap).blobs.empty());
}

TEST(LiveMesh, AMapThatLeftLeavesNoTrace) {
  LiveMesh mesh(Enough()), other(Enough());
  std::map<uint32_t, ConfirmedMap> maps = Maps(5);
  mesh.Update(kSubmap, maps);
  Finish(&mesh);
  for (const uint32_t id : {2, 4}) maps.erase(id);  // the median pixel stays that of map 3
  mesh.Update(kSubmap, maps);
  Finish(&mesh);
  other.Update(kSubmap, maps);
  Finish(&other);
  EXPECT_EQ(ContentsOf(mesh.MeshOfSubmap(kSubmap)), ContentsOf(other.MeshOfSubmap(kSubmap)));
}

// One map of four is 0.5 off, then comes to its place.
TEST(LiveMesh, AMapThatMovedIsAddedAgain) {
  LiveMesh mesh(Enough()), other(Enough());
  std::map<uint32_t, ConfirmedMap> maps = Maps(4);
  maps[2].map.cam_from_world.translation.z() += 0.5;
  mesh.Update(kSubmap, maps);
  Finish(&mesh);
  EXPECT_GT(MeanDistanceFromWall(mesh.MeshOfSubmap(kSubmap)), kPixel / 4);
  mesh.Update(kSubmap, Maps(4));
  Finish(&mesh);
  other.Update(kSubmap, Maps(4));
  Finish(&other);
  EXPECT_EQ(ContentsOf(mesh.MeshOfSubmap(kSubmap)), ContentsOf(other.MeshOfSubmap(kSubmap)));
}

// Until the new volume is full, chunks and frame are the old ones.
TEST(LiveMesh, WhereMostMapsMovedTheOldMeshStaysUntilTheNewOneIsThere) {
  LiveMesh mesh(Enough());
  std::map<uint32_t, ConfirmedMap> maps = Maps(3);
  mesh.Update(kSubmap, maps);
  Finish(&mesh);
  const SubmapMesh before = mesh.MeshOfSubmap(kSubmap);
  for (auto& [id, map] : maps) map.map.cam_from_world.translation.x() += 5;
  mesh.Update(kSubmap, maps);
  ASSERT_TRUE(mesh.Step(kSubmap, kUtimeUs));
  EXPECT_EQ(mesh.MeshOfSubmap(kSubmap).blobs, before.blobs);
  EXPECT_EQ(mesh.MeshOfSubmap(kSubmap).list.frame[0].tvec, before.list.frame[0].tvec);
  Finish(&mesh);
  const SubmapMesh after = mesh.MeshOfSubmap(kSubmap);
  EXPECT_NEAR(after.list.frame[0].tvec[0], before.list.frame[0].tvec[0] + 5, 1e-9);
  for (const auto& [id, bytes] : after.blobs) EXPECT_EQ(before.blobs.count(id), 0u);
  for (const DenseManifest::Mesh::Chunk& chunk : after.list.chunks) EXPECT_GT(chunk.version, 0u);
}

TEST(LiveMesh, AScaleOfDepthsThatWereForgottenScalesThem) {
  LiveMesh mesh(Enough());
  std::map<uint32_t, ConfirmedMap> maps = Maps(3);
  mesh.Update(kSubmap, maps);
  Finish(&mesh);
  for (auto& [id, map] : maps) {
    const DepthPose pose = map.map.cam_from_world;
    map = {DepthMap(), cv::Mat3b(), 3, map.revision};
    map.map.cam_from_world = {pose.rotation, 3 * pose.translation};
  }
  mesh.Update(kSubmap, maps);
  Finish(&mesh);
  EXPECT_NEAR(mesh.VoxelOf(kSubmap), 3 * kPixel, 0.03) << "voxels follow the unit";
  EXPECT_LT(MeanDistanceFromWall(mesh.MeshOfSubmap(kSubmap), 3), kPixel / 10);
}

TEST(LiveMesh, KeepsTheBudgetOfTriangles) {
  LiveMeshOptions options = Enough();
  options.max_triangles = 3000;
  LiveMesh mesh(options);
  mesh.Update(kSubmap, Maps(3));
  Finish(&mesh);
  EXPECT_LE(mesh.num_triangles(), options.max_triangles);
  EXPECT_GT(mesh.num_triangles(), 100);
  EXPECT_GT(mesh.VoxelOf(kSubmap), 2 * kPixel);
  EXPECT_LT(MeanDistanceFromWall(mesh.MeshOfSubmap(kSubmap)), mesh.VoxelOf(kSubmap) / 4);
}

TEST(LiveMesh, KeepsTheBoundOfMemory) {
  LiveMeshOptions options;
  options.max_bytes = 300 * static_cast<int64_t>(sizeof(Block));
  LiveMesh mesh(options);
  mesh.Update(kSubmap, Maps(3));
  Finish(&mesh);
  EXPECT_LE(mesh.memory_bytes(), options.max_bytes);
  EXPECT_GT(mesh.num_triangles(), 100);
}

// As after a while without an idle moment: all of them come before the first step.
TEST(LiveMesh, MapsThatTakeMoreThanTheLimitKeepEverySecondRowAndColumn) {
  std::map<uint32_t, ConfirmedMap> maps;
  for (uint32_t i = 1; i <= 30; ++i) maps[i] = MapAt(PoseAt({0.01 * i, 0, 0}), i);
  const int64_t map_bytes = 11 * static_cast<int64_t>(maps[1].map.depth.total());
  LiveMeshOptions options;
  options.max_bytes = 24 * map_bytes;
  LiveMesh mesh(options);
  mesh.Update(kSubmap, maps);
  Finish(&mesh);
  EXPECT_NEAR(mesh.VoxelOf(kSubmap), 2 * kPixel, 0.02);
  EXPECT_LE(mesh.memory_bytes(), options.max_bytes);
  EXPECT_GT(mesh.num_triangles(), 100);
}

TEST(LiveMesh, AMapWithoutASurfaceHasNoMesh) {
  LiveMesh mesh(Enough());
  std::map<uint32_t, ConfirmedMap> maps = Maps(1);
  maps[1].map.depth = cv::Mat1f::zeros(maps[1].map.depth.size());
  mesh.Update(kSubmap, maps);
  Finish(&mesh);
  EXPECT_TRUE(mesh.MeshOfSubmap(kSubmap).list.chunks.empty());
}

TEST(LiveMesh, ASubmapThatEndedHasNone) {
  LiveMesh mesh(Enough());
  mesh.Update(kSubmap, Maps(2));
  Finish(&mesh);
  const uint64_t changes = mesh.changes();
  mesh.Drop(kSubmap);
  EXPECT_GT(mesh.changes(), changes);
  EXPECT_TRUE(mesh.MeshOfSubmap(kSubmap).list.chunks.empty());
  EXPECT_EQ(mesh.memory_bytes(), 0);
}

}  // namespace skein::live_mesh_test
