#include "matching/messages.h"

#include <gtest/gtest.h>

#include "ledger/facts.h"
#include "transport/bus.h"

namespace skein::messages_test {

PhotoMatches SomeMatches(int num_pairs) {
  PhotoMatches matches;
  matches.num_tried = 30;
  matches.match_s = 1.5;
  matches.verify_s = 0.25;
  for (int i = 0; i < num_pairs; ++i) {
    TwoViewPair pair;
    pair.other_id = 10 + i;
    pair.geometry = 2;
    pair.tri_angle_rad = 0.5f;
    pair.forward_motion = 0.25f;
    pair.inliers.resize(40 - i);
    matches.pairs.push_back(pair);
  }
  return matches;
}

TEST(MatchingMessages, RoundTrip) {
  const matches_t sent = ToMessage(42, SomeMatches(2), std::string(64, 'a'));
  const Bytes bytes = EncodeFact(sent);
  const auto fact = DecodeFact(FactKindFromName("matches"), bytes.data(), bytes.size());
  ASSERT_TRUE(fact.ok()) << fact.error();
  const auto& got = std::get<matches_t>(*fact);
  EXPECT_EQ(got.header.fact_id, "matches/42");
  EXPECT_EQ(got.image_id, 42);
  EXPECT_EQ(got.num_tried, 30);
  EXPECT_EQ(got.match_s, 1.5f);
  EXPECT_EQ(got.verify_s, 0.25f);
  EXPECT_EQ(got.pairs_blob, std::string(64, 'a'));
  ASSERT_EQ(got.num_pairs, 2);
  EXPECT_EQ(got.pairs[1].other_id, 11);
  EXPECT_EQ(got.pairs[1].num_inliers, 39);
  EXPECT_EQ(got.pairs[1].geometry, 2);
  EXPECT_EQ(got.pairs[1].tri_angle_rad, 0.5f);
  EXPECT_EQ(got.pairs[1].forward_motion, 0.25f);
}

TEST(MatchingMessages, ThirtyPairsFitOneFrame) {
  matches_t message = ToMessage(123456, SomeMatches(30), std::string(64, 'a'));
  message.header.session_id = std::string(16, 's');
  message.header.author = "hostb-matching-12";
  EXPECT_LE(EncodeFact(message).size() + kMaxTrailerBytes, kMaxDatagramBytes);
}

TEST(MatchingMessages, CameraNeedsSizeAndFocalLength) {
  image_t image{};
  image.image_id = 1;
  image.width_px = 1600;
  image.height_px = 1200;
  image.focal_px = 1300;
  image.focal_from_exif = 1;
  const auto camera = CameraFromMessage(image);
  ASSERT_TRUE(camera.ok());
  EXPECT_TRUE(camera->HasPriorFocalLength());
  EXPECT_EQ(camera->MeanFocalLength(), 1300);
  EXPECT_EQ(camera->PrincipalPointX(), 800);
  image.focal_px = 0;
  EXPECT_FALSE(CameraFromMessage(image).ok());
}

}  // namespace skein::messages_test
