#include "formats/shape.h"

#include <gtest/gtest.h>

namespace skein::shape_test {

ShapeChunk SmallChunk() {
  ShapeChunk chunk;
  chunk.origin = {-1.5, 2, 1e6};
  chunk.step = 0.25;
  chunk.version = (uint64_t{1} << 50) + 3;
  chunk.points = {{{0, 1, 65535}, {10, 20, 255}, 3}, {{7, 8, 9}, {0, 0, 0}, 255}};
  return chunk;
}

TEST(Shape, AChunkHasTheBytesThatABrowserReads) {
  const Bytes bytes = EncodeShapeChunk(SmallChunk());
  ASSERT_EQ(bytes.size(), kShapeChunkHeaderBytes + 2 * kShapePointBytes);
  EXPECT_EQ(std::string(bytes.begin(), bytes.begin() + 4), "SKC1");
  uint32_t count = 0;
  double z = 0, step = 0;
  uint64_t version = 0;
  uint16_t last = 0;
  std::memcpy(&count, &bytes[4], 4);
  std::memcpy(&z, &bytes[24], 8);
  std::memcpy(&step, &bytes[32], 8);
  std::memcpy(&version, &bytes[40], 8);
  std::memcpy(&last, &bytes[52], 2);
  EXPECT_EQ(count, 2u);
  EXPECT_EQ(z, 1e6);
  EXPECT_EQ(step, 0.25);
  EXPECT_EQ(version, SmallChunk().version);
  EXPECT_EQ(last, 65535);
  EXPECT_EQ(bytes[56], 255) << "blue of the first point";
  EXPECT_EQ(bytes[57], 3) << "photos that see it";
}

TEST(Shape, ChunksComeBackAsTheyWere) {
  const Bytes bytes = EncodeShapeChunk(SmallChunk());
  const Result<ShapeChunk> chunk = DecodeShapeChunk(bytes);
  ASSERT_TRUE(chunk.ok()) << chunk.error();
  EXPECT_EQ(EncodeShapeChunk(*chunk), bytes);
}

TEST(Shape, DamagedChunksAreRefused) {
  const Bytes bytes = EncodeShapeChunk(SmallChunk());
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(DecodeShapeChunk(Bytes(bytes.begin(), bytes.begin() + size)).ok()) << size;
  }
  Bytes longer = bytes;
  longer.push_back(0);
  EXPECT_FALSE(DecodeShapeChunk(longer).ok());
  Bytes many = bytes;
  many[7] = 255;
  EXPECT_FALSE(DecodeShapeChunk(many).ok()) << "a count above what there is";
  ShapeChunk large;
  large.points.resize(ShapeChunk::kMaxPoints + 1);
  EXPECT_THROW(EncodeShapeChunk(large), std::invalid_argument);
}

TEST(Shape, TracksComeBackAsTheyWere) {
  const PointTracks tracks{{2, 2, 3}, {{1, 10}, {2, 20}, {7, 70}}};
  const Bytes bytes = EncodePointTracks(tracks);
  const Result<PointTracks> read = DecodePointTracks(bytes);
  ASSERT_TRUE(read.ok()) << read.error();
  EXPECT_EQ(EncodePointTracks(*read), bytes);
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(DecodePointTracks(Bytes(bytes.begin(), bytes.begin() + size)).ok()) << size;
  }
}

TEST(Shape, TracksThatPointElsewhereAreRefused) {
  const std::vector<PointObservation> two = {{1, 1}, {2, 2}};
  EXPECT_FALSE(DecodePointTracks(EncodePointTracks({{2, 1}, two})).ok());
  EXPECT_FALSE(DecodePointTracks(EncodePointTracks({{1, 3}, two})).ok());
  EXPECT_FALSE(DecodePointTracks(EncodePointTracks({{1}, two})).ok());
  EXPECT_TRUE(DecodePointTracks(EncodePointTracks({{}, {}})).ok());
}

TEST(Shape, ManifestsComeBackAsTheyWere) {
  ShapeManifest manifest;
  manifest.version = 12;
  manifest.photos = {{3, 1, {1, 0, 0, 0}, {1, 2, 3}}};
  manifest.cameras = {{1, 640, 480, 500, 501, 320, 240, 1, {500, 501, 320, 240}}};
  manifest.chunks = {{1, 11, 4, "aa", "bb", 100}, {5, 12, 9, "cc", "", 0}};
  const Bytes bytes = EncodeShapeManifest(manifest);
  const Result<ShapeManifest> read = DecodeShapeManifest(bytes);
  ASSERT_TRUE(read.ok()) << read.error();
  EXPECT_EQ(EncodeShapeManifest(*read), bytes);
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(DecodeShapeManifest(Bytes(bytes.begin(), bytes.begin() + size)).ok()) << size;
  }
}

}  // namespace skein::shape_test
