#include "surface/model_mesh.h"

#include <gtest/gtest.h>

#include "testing/wall_maps.h"

namespace skein::surface_test {
namespace {

class ModelMeshTest : public testing::Test {
 protected:
  std::vector<ColouredMap> Maps() const {
    std::vector<ColouredMap> maps;
    for (const WallMap& map : maps_) maps.push_back(map.Coloured());
    return maps;
  }

  std::vector<WallMap> maps_ = {WallMap(PoseAt({0, 0, 0})), WallMap(PoseAt({1.3, 0.4, 0.2}))};
};

TEST_F(ModelMeshTest, AVoxelIsAPixelOnTheGround) {
  const Result<ModelMesh> made = MakeModelMesh(Maps(), MeshOptions());
  ASSERT_TRUE(made.ok()) << made.error();
  EXPECT_NEAR(made->voxel, 10 / 150.0, 0.01);
  EXPECT_EQ(made->voxel, made->ground_sampling_distance);
  EXPECT_GT(made->mesh.NumTriangles(), 30000);
}

TEST_F(ModelMeshTest, KeepsTheBudgetOfTriangles) {
  MeshOptions options;
  options.max_triangles = 3000;
  const Result<ModelMesh> made = MakeModelMesh(Maps(), options);
  ASSERT_TRUE(made.ok()) << made.error();
  EXPECT_LE(made->mesh.NumTriangles(), options.max_triangles);
  EXPECT_GT(made->mesh.NumTriangles(), options.max_triangles / 4) << "and uses it";
  EXPECT_GT(made->voxel, 2 * made->ground_sampling_distance);
}

TEST_F(ModelMeshTest, KeepsTheBoundOfMemory) {
  MeshOptions options;
  options.max_bytes = 100 * static_cast<int64_t>(sizeof(Block));
  const Result<ModelMesh> made = MakeModelMesh(Maps(), options);
  ASSERT_TRUE(made.ok()) << made.error();
  EXPECT_GT(made->voxel, 2 * made->ground_sampling_distance);
}

TEST_F(ModelMeshTest, MapsOfHolesHaveNoSurface) {
  for (WallMap& map : maps_) map.map.depth = 0;
  EXPECT_EQ(MakeModelMesh(Maps(), MeshOptions()).code(), StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace skein::surface_test
