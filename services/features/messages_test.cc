#include "features/messages.h"

#include <gtest/gtest.h>

#include "ledger/facts.h"

namespace skein::messages_test {

PhotoDescription SomeDescription() {
  PhotoDescription photo;
  photo.local.keypoints.resize(3);
  photo.global.model = "vlad-2";
  photo.global.values = {1, 0};
  photo.quality.texture.Set(63, 47);
  photo.quality.texture.Set(1, 0);
  photo.local_s = 0.5;
  photo.global_s = 0.25;
  return photo;
}

const ResultBlobs kBlobs{std::string(64, 'a'), std::string(64, 'b'), std::string(64, 'c')};

TEST(FeaturesMessages, RoundTrip) {
  const features_t sent = ToMessage(42, 7, SomeDescription(), kBlobs);
  const Bytes bytes = EncodeFact(sent);
  const auto fact = DecodeFact(FactKindFromName("features"), bytes.data(), bytes.size());
  ASSERT_TRUE(fact.ok()) << fact.error();
  const auto& got = std::get<features_t>(*fact);
  EXPECT_EQ(got.header.fact_id, "features/42");
  EXPECT_EQ(got.header.computed_at_seq, 7);
  EXPECT_EQ(got.image_id, 42);
  EXPECT_EQ(got.num_keypoints, 3);
  EXPECT_EQ(got.keypoints_blob, kBlobs.keypoints);
  EXPECT_EQ(got.descriptors_blob, kBlobs.descriptors);
  EXPECT_EQ(got.global_blob, kBlobs.global);
  EXPECT_EQ(got.global_model, "vlad-2");
  EXPECT_EQ(got.texture[0], 2);
  EXPECT_EQ(got.texture[383], 128);
  EXPECT_EQ(got.local_s, 0.5F);
  EXPECT_EQ(got.global_s, 0.25F);
}

TEST(FeaturesMessages, APhotoWithoutTextureIsAFactToo) {
  PhotoDescription photo;
  photo.global.model = "vlad-2";
  const features_t message = ToMessage(1, 0, photo, kBlobs);
  EXPECT_EQ(message.num_keypoints, 0);
  EXPECT_EQ(message.global_model, "vlad-2");
}

TEST(FeaturesMessages, NamesItsBlobsForIngestToPull) {
  const Fact fact = ToMessage(42, 7, SomeDescription(), kBlobs);
  std::vector<std::string> blobs = BlobsOf(fact);
  std::sort(blobs.begin(), blobs.end());
  EXPECT_EQ(blobs, (std::vector<std::string>{kBlobs.keypoints, kBlobs.descriptors, kBlobs.global}));
}

}  // namespace skein::messages_test
