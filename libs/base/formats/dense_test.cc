#include "formats/dense.h"

#include <gtest/gtest.h>

#include <limits>

namespace skein::dense_format_test {

DenseManifest Example() {
  DenseManifest manifest;
  manifest.version = 77;
  manifest.photos.resize(2);
  manifest.photos[0].image_id = 3;
  manifest.photos[0].scale = 1.25;
  manifest.photos[0].share = 0.5f;
  manifest.photos[0].chunks = {{192, 70, 16384, "ab"}, {193, 71, 5, "cd"}};
  manifest.photos[1].image_id = 9;
  manifest.mesh.voxel = 0.02;
  manifest.mesh.frame = {{3, {0, 1, 0, 0}, {1, 2, 3}}};
  manifest.mesh.chunks = {{7, 71, 400, 700, "ef"}, {8, 72, 3, 1, "gh"}};
  return manifest;
}

TEST(DenseManifest, ComesBackAsItWas) {
  const Bytes bytes = EncodeDenseManifest(Example());
  const Result<DenseManifest> read = DecodeDenseManifest(bytes);
  ASSERT_TRUE(read.ok()) << read.error();
  EXPECT_EQ(EncodeDenseManifest(*read), bytes);
  EXPECT_EQ(read->NumPoints(), 16389);
  EXPECT_EQ(read->photos[0].scale, 1.25);
  EXPECT_EQ(read->photos[0].chunks[1].points_blob, "cd");
  EXPECT_EQ(read->NumTriangles(), 701);
  EXPECT_EQ(read->mesh.frame[0].tvec[2], 3);
  EXPECT_EQ(read->mesh.chunks[1].blob, "gh");
}

TEST(DenseManifest, IsRefusedWhenItIsCutShort) {
  const Bytes bytes = EncodeDenseManifest(Example());
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(DecodeDenseManifest(Bytes(bytes.begin(), bytes.begin() + size)).ok()) << size;
  }
}

TEST(DenseManifest, IsRefusedWithNumbersThatMakeNoSense) {
  for (const double scale : {0.0, -1.0, std::numeric_limits<double>::infinity(),
                             std::numeric_limits<double>::quiet_NaN()}) {
    DenseManifest manifest = Example();
    manifest.photos[1].scale = scale;
    EXPECT_FALSE(DecodeDenseManifest(EncodeDenseManifest(manifest)).ok()) << scale;
  }
  DenseManifest manifest = Example();
  manifest.photos[0].chunks[0].num_points = 16385;
  EXPECT_FALSE(DecodeDenseManifest(EncodeDenseManifest(manifest)).ok());
  manifest = Example();
  manifest.mesh.chunks[0].num_vertices = 65537;
  EXPECT_FALSE(DecodeDenseManifest(EncodeDenseManifest(manifest)).ok());
  manifest = Example();
  manifest.mesh.frame[0].qvec[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(DecodeDenseManifest(EncodeDenseManifest(manifest)).ok());
}

}  // namespace skein::dense_format_test
