#include "dense/dense_service.h"

#include <gtest/gtest.h>

#include <atomic>
#include <new>
#include <stdexcept>

#include "formats/mesh_chunk.h"
#include "shapes/dense_follower.h"
#include "testing/test_photos.h"
#include "testing/test_shape.h"
#include "testing/test_wall.h"

namespace skein::dense_service_test {

// The photos are of a wall; a further process follows what comes of them.
class DenseServiceTest : public ShapeServiceTest {
 protected:
  DenseServiceTest() : ShapeServiceTest("dense", 60) { wall_.Walk(4); }

  void StorePhoto(uint32_t image_id, Bytes bytes) {
    image_t image{};
    image.image_id = image_id;
    image.agent = "alice";
    image.name = std::to_string(image_id) + ".png";
    image.blob_id = ingest_node_.blobs().Serve(std::move(bytes));
    Commit(image);
  }
  void StorePhotos() {
    for (uint32_t id = 1; id <= 4; ++id) StorePhoto(id, Encode(wall_.Picture(id), ".png"));
  }
  void ShowMap(uint64_t version) { Show(*wall_.MakeShape(kSubmap, version)); }
  std::unique_ptr<DenseService> Start(int surface_memory_mib = 512) {
    DenseOptions options;
    options.surface_memory_mib = surface_memory_mib;
    options.size_px = depth_test::kWallWidth;
    return std::make_unique<DenseService>(node_, options);
  }
  size_t NumPhotos() const {
    const DensePointsPtr points = store_.Find(kSubmap);
    return points == nullptr ? 0 : points->manifest.photos.size();
  }

  TestWall wall_;
  Node web_{TestOptions("web"), loop_, bus_};
  bool is_live_ = true;
  int num_told_ = 0;
  DenseStore store_;
  DenseFollower follower_{web_, store_, [this](int64_t) { return is_live_; },
                          [this](int64_t, const DensePoints&) { ++num_told_; }};
};

TEST_F(DenseServiceTest, PublishesPointsOfPhotosThatAreInAMap) {
  StorePhotos();
  ShowMap(1);
  const auto service = Start();
  ASSERT_TRUE(WaitFor([&] { return NumPhotos() == 4; }));
  const DensePointsPtr points = store_.Find(kSubmap);
  EXPECT_EQ(points->owner, "dense");
  EXPECT_GT(points->manifest.NumPoints(), 10'000);
  const DenseManifest::Chunk& chunk = points->manifest.photos[0].chunks[0];
  std::optional<Result<Bytes>> bytes;
  web_.blobs().Fetch(chunk.points_blob, points->owner,
                     [&](Result<Bytes> came) { bytes = std::move(came); });
  ASSERT_TRUE(WaitFor([&] { return bytes.has_value(); }));
  ASSERT_TRUE(bytes->ok()) << bytes->error();
  EXPECT_EQ(DecodeShapeChunk(**bytes)->points.size(), chunk.num_points);
}

TEST_F(DenseServiceTest, PublishesTheirMesh) {
  StorePhotos();
  ShowMap(1);
  const auto service = Start();
  ASSERT_TRUE(WaitFor([&] {
    const DensePointsPtr points = store_.Find(kSubmap);
    return points != nullptr && points->manifest.NumTriangles() > 1000;
  }));
  const DensePointsPtr points = store_.Find(kSubmap);
  EXPECT_GT(points->manifest.mesh.voxel, 0);
  EXPECT_FALSE(points->manifest.mesh.frame.empty());
  const DenseManifest::Mesh::Chunk& entry = points->manifest.mesh.chunks[0];
  std::optional<Result<Bytes>> bytes;
  web_.blobs().Fetch(entry.blob, points->owner,
                     [&](Result<Bytes> came) { bytes = std::move(came); });
  ASSERT_TRUE(WaitFor([&] { return bytes.has_value(); }));
  ASSERT_TRUE(bytes->ok()) << bytes->error();
  EXPECT_EQ(DecodeMeshChunk(**bytes)->triangles.size(), entry.num_triangles);
}

TEST_F(DenseServiceTest, WithoutMemoryForItNoMeshIsMade) {
  StorePhotos();
  ShowMap(1);
  const auto service = Start(0);
  ASSERT_TRUE(WaitFor([&] { return NumPhotos() == 4; }));
  EXPECT_FALSE(
      loop_.RunUntil([&] { return store_.Find(kSubmap)->manifest.NumTriangles() > 0; }, 3));
}

TEST_F(DenseServiceTest, APhotoThatCannotBeDecodedIsLeftOut) {
  StorePhoto(1, Bytes(5000, 7));
  for (uint32_t id = 2; id <= 4; ++id) StorePhoto(id, Encode(wall_.Picture(id), ".png"));
  ShowMap(1);
  const auto service = Start();
  ASSERT_TRUE(WaitFor([&] { return NumPhotos() == 3; }));
  EXPECT_NE(store_.Find(kSubmap)->manifest.photos[0].image_id, 1u);
}

TEST_F(DenseServiceTest, APhotoOnWhichAnExceptionComesIsLeftOut) {
  StorePhotos();
  ShowMap(1);
  node_.steps().OnBegin([](const Step& step) {
    if (step.name == "depth map" && step.item == 1) throw std::bad_alloc();
  });
  const auto service = Start();
  ASSERT_TRUE(WaitFor([&] { return NumPhotos() == 3; }));
  EXPECT_NE(store_.Find(kSubmap)->manifest.photos[0].image_id, 1u);
}

TEST_F(DenseServiceTest, AMeshOnWhichAnExceptionComesBeginsAgain) {
  StorePhotos();
  ShowMap(1);
  std::atomic<int> num_thrown{0};
  node_.steps().OnBegin([&](const Step& step) {
    if (step.name == "mesh" && num_thrown < kMaxFailures - 1 && ++num_thrown > 0)
      throw std::runtime_error("no surface");
  });
  const auto service = Start();
  ASSERT_TRUE(WaitFor([&] {
    const DensePointsPtr points = store_.Find(kSubmap);
    return points != nullptr && points->manifest.NumTriangles() > 1000;
  }));
  EXPECT_EQ(num_thrown, kMaxFailures - 1);
}

// Depth maps do without it.
TEST_F(DenseServiceTest, AMeshThatAlwaysThrowsIsLeftOut) {
  StorePhotos();
  ShowMap(1);
  std::atomic<int> num_thrown{0};
  node_.steps().OnBegin([&](const Step& step) {
    if (step.name != "mesh") return;
    ++num_thrown;
    throw std::runtime_error("no surface");
  });
  const auto service = Start();
  ASSERT_TRUE(WaitFor([&] { return num_thrown >= kMaxFailures && NumPhotos() == 4; }));
  ShowMap(2);
  loop_.RunUntil([] { return false; }, 2);
  EXPECT_EQ(num_thrown, kMaxFailures) << "not tried any more";
  EXPECT_EQ(store_.Find(kSubmap)->manifest.NumTriangles(), 0);
}

TEST_F(DenseServiceTest, AnotherOneBeginsAgain) {
  StorePhotos();
  ShowMap(1);
  auto service = Start();
  ASSERT_TRUE(WaitFor([&] { return NumPhotos() == 4; }));
  service.reset();
  const uint64_t version = store_.Find(kSubmap)->manifest.version;
  service = Start();
  ASSERT_TRUE(WaitFor([&] { return store_.Find(kSubmap)->manifest.version > version; }));
}

TEST_F(DenseServiceTest, NothingIsTakenOfAMapThatHasEnded) {
  is_live_ = false;
  StorePhotos();
  ShowMap(1);
  int num_messages = 0;
  bus_.Subscribe(kDensePointsChannel, [&](const dense_points_t&) { ++num_messages; });
  const auto service = Start();
  ASSERT_TRUE(WaitFor([&] { return num_messages >= 2; }));
  EXPECT_EQ(NumPhotos(), 0u);
  EXPECT_EQ(num_told_, 0);
}

}  // namespace skein::dense_service_test
