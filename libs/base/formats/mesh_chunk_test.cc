#include "formats/mesh_chunk.h"

#include <gtest/gtest.h>

#include <cstring>
#include <stdexcept>
#include <string>

namespace skein::mesh_chunk_test {

MeshChunk Square() {
  MeshChunk chunk;
  chunk.origin = {-1.5, 2, 1e6};
  chunk.step = 0.25;
  chunk.version = (uint64_t{1} << 50) + 3;
  chunk.vertices = {{{0, 0, 7}, {10, 20, 255}},
                    {{65535, 0, 7}, {1, 2, 3}},
                    {{65535, 9, 7}, {4, 5, 6}},
                    {{0, 9, 7}, {0, 0, 0}}};
  chunk.triangles = {{0, 1, 2}, {0, 2, 3}};
  return chunk;
}

TEST(MeshChunk, HasTheBytesThatABrowserReads) {
  const Bytes bytes = EncodeMeshChunk(Square());
  ASSERT_EQ(bytes.size(), MeshChunkBytes(4, 2));
  EXPECT_EQ(std::string(bytes.begin(), bytes.begin() + 4), "SKT1");
  uint32_t num_triangles = 0;
  double z = 0, step = 0;
  uint16_t x = 0, last = 0;
  std::memcpy(&num_triangles, &bytes[8], 4);
  std::memcpy(&z, &bytes[28], 8);
  std::memcpy(&step, &bytes[36], 8);
  std::memcpy(&x, &bytes[61], 2);
  std::memcpy(&last, &bytes[bytes.size() - 2], 2);
  EXPECT_EQ(num_triangles, 2u);
  EXPECT_EQ(z, 1e6);
  EXPECT_EQ(step, 0.25);
  EXPECT_EQ(x, 65535) << "of the second vertex";
  EXPECT_EQ(bytes[60], 255) << "blue of the first vertex";
  EXPECT_EQ(last, 3);
}

TEST(MeshChunk, ComesBackAsItWas) {
  const Bytes bytes = EncodeMeshChunk(Square());
  const Result<MeshChunk> chunk = DecodeMeshChunk(bytes);
  ASSERT_TRUE(chunk.ok()) << chunk.error();
  EXPECT_EQ(EncodeMeshChunk(*chunk), bytes);
}

TEST(MeshChunk, IsRefusedWithAnotherSize) {
  Bytes bytes = EncodeMeshChunk(Square());
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(DecodeMeshChunk(Bytes(bytes.begin(), bytes.begin() + size)).ok()) << size;
  }
  bytes.push_back(0);
  EXPECT_FALSE(DecodeMeshChunk(bytes).ok());
  Bytes claims = EncodeMeshChunk(Square());
  const uint32_t huge = 0xffffffff;
  std::memcpy(&claims[8], &huge, 4);
  EXPECT_FALSE(DecodeMeshChunk(claims).ok());
}

TEST(MeshChunk, IsRefusedWithAnIndexOfNoVertex) {
  MeshChunk chunk = Square();
  chunk.triangles[1][2] = 4;
  EXPECT_FALSE(DecodeMeshChunk(EncodeMeshChunk(chunk)).ok());
}

TEST(MeshChunk, IsNotWrittenWithMoreThanItsIndicesReach) {
  MeshChunk chunk;
  chunk.vertices.resize(MeshChunk::kMaxVertices + 1);
  EXPECT_THROW(EncodeMeshChunk(chunk), std::invalid_argument);
}

}  // namespace skein::mesh_chunk_test
