#include "surface/surface_volume.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "testing/wall_maps.h"

namespace skein::surface_test {
namespace {

constexpr double kVolumeVoxel = 0.08;

SurfaceVolume EmptyVolume(int num_threads = 2) {
  SurfaceOptions options;
  options.voxel = kVolumeVoxel;
  options.num_threads = num_threads;
  return SurfaceVolume(options);
}

SurfaceVolume VolumeOf(const std::vector<const WallMap*>& maps, int num_threads = 2) {
  SurfaceVolume volume = EmptyVolume(num_threads);
  for (const WallMap* map : maps) EXPECT_TRUE(volume.Add(map->Coloured()).ok());
  return volume;
}

bool AreEqual(const Voxel& a, const Voxel& b) {
  return a.weight == b.weight && a.distance == b.distance && a.colour == b.colour;
}

void ExpectEqual(const SurfaceVolume& a, const SurfaceVolume& b) {
  ASSERT_EQ(a.Blocks(), b.Blocks());
  EXPECT_EQ(a.Bytes(), b.Bytes());
  for (const BlockIndex& index : a.Blocks()) {
    for (int i = 0; i < kBlockVoxels; ++i) {
      ASSERT_TRUE(AreEqual((*a.Find(index))[i], (*b.Find(index))[i])) << index.x << " " << i;
    }
  }
}

const WallMap& Left() {
  static const WallMap map(PoseAt({0, 0, 0}));
  return map;
}

const WallMap& Right() {
  static const WallMap map(PoseAt({1.3, 0.4, 0.2}, 0.1, 0.3), 0.05f);
  return map;
}

// As in a national grid.
TEST(SurfaceVolume, AMapFarFromTheOriginIsInIt) {
  WallMap far = Left();
  far.map.cam_from_world.translation.x() -= 1e6;
  const size_t expected = VolumeOf({&Left()}).Blocks().size();
  EXPECT_NEAR(VolumeOf({&far}).Blocks().size(), expected, expected / 10);
}

// As one photo from far away: its errors are those of its distance.
TEST(SurfaceVolume, DepthsWithoutAWeightTouchNoBlock) {
  const WallMap rough(PoseAt({0, 0, 0}), 12 * kVolumeVoxel);
  EXPECT_TRUE(MapBand(rough.map, kVolumeVoxel, 2).Blocks().empty());
}

TEST(SurfaceVolume, AVoxelHasItsDistanceFromTheWallAndItsColour) {
  const SurfaceVolume volume = VolumeOf({&Left()});
  int count = 0;
  for (const BlockIndex& index : volume.Blocks()) {
    for (int i = 0; i < kBlockVoxels; ++i) {
      const Voxel& voxel = (*volume.Find(index))[i];
      if (voxel.weight == 0) continue;
      const Eigen::Vector3d at =
          kVolumeVoxel * Eigen::Vector3d(kBlockSide * index.x + i % kBlockSide,
                                         kBlockSide * index.y + i / kBlockSide % kBlockSide,
                                         kBlockSide * index.z + i / kBlockSide / kBlockSide);
      const Wall wall;
      const double truth = WallNormal().dot(at - Eigen::Vector3d(0, 0, wall.distance));
      ASSERT_NEAR(voxel.Distance() * kVolumeVoxel, truth, kVolumeVoxel / 2) << at.transpose();
      for (int c = 0; c < 3; ++c) ASSERT_EQ(voxel.colour[c], voxel.weight * kWallColour[c]);
      ++count;
    }
  }
  EXPECT_GT(count, 50000) << "a band of eight voxels";
}

TEST(SurfaceVolume, TwoMapsWithoutOneAreTheOther) {
  SurfaceVolume both = VolumeOf({&Left(), &Right()});
  EXPECT_GT(both.Bytes(), VolumeOf({&Left()}).Bytes());
  both.Remove(Right().Coloured());
  ExpectEqual(both, VolumeOf({&Left()}));
  both.Remove(Left().Coloured());
  EXPECT_TRUE(both.Blocks().empty());
  EXPECT_EQ(both.Bytes(), 0);
}

TEST(SurfaceVolume, NeitherOrderNorThreadsMatter) {
  ExpectEqual(VolumeOf({&Left(), &Right()}, 1), VolumeOf({&Right(), &Left()}, 3));
}

TEST(SurfaceVolume, TellsTheBlocksThatChanged) {
  const WallMap far(PoseAt({50, 0, 0}));
  SurfaceVolume volume = VolumeOf({&Left()});
  EXPECT_EQ(volume.version(), 1U);
  EXPECT_FALSE(volume.ChangedSince(0).empty());
  EXPECT_TRUE(volume.ChangedSince(1).empty());
  const std::vector<BlockIndex> before = volume.Blocks();
  ASSERT_TRUE(volume.Add(far.Coloured()).ok());
  const std::vector<BlockIndex> added = volume.ChangedSince(1);
  EXPECT_FALSE(added.empty());
  volume.Remove(far.Coloured());
  EXPECT_EQ(volume.ChangedSince(2), added) << "blocks that are empty again";
  EXPECT_EQ(volume.Blocks(), before);
}

TEST(SurfaceVolume, AMapThatHasNoRoomChangesNothing) {
  SurfaceOptions options;
  options.voxel = kVolumeVoxel;
  options.max_bytes = 10 * static_cast<int64_t>(sizeof(Block));
  SurfaceVolume volume(options);
  EXPECT_EQ(volume.Add(Left().Coloured()).code, StatusCode::kResourceExhausted);
  EXPECT_EQ(volume.Bytes(), 0);
  EXPECT_EQ(volume.version(), 0U);
  EXPECT_TRUE(volume.Blocks().empty());
}

TEST(SurfaceVolume, AWrongDepthCountsLittle) {
  const WallMap good(PoseAt({0, 0, 0}), 0.02f);
  WallMap bad(PoseAt({0, 0, 0}), 0.4f);
  bad.map.depth += 0.15;
  const SurfaceVolume volume = VolumeOf({&good, &bad}), alone = VolumeOf({&good});
  double most = 0;
  for (const BlockIndex& index : alone.Blocks()) {
    for (int i = 0; i < kBlockVoxels; ++i) {
      const Voxel& one = (*alone.Find(index))[i];
      if (one.weight < kMostWeight / 2) continue;
      const double moved = (*volume.Find(index))[i].Distance() - one.Distance();
      most = std::max(most, std::abs(moved));
    }
  }
  EXPECT_LT(most, 0.1) << "voxels; the error is 20 times as large";
}

TEST(SurfaceVolume, NeedsAVoxel) {
  EXPECT_THROW(SurfaceVolume{SurfaceOptions()}, std::invalid_argument);
}

}  // namespace
}  // namespace skein::surface_test
