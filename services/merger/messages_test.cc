#include "merger/messages.h"

#include <gtest/gtest.h>

#include <limits>

#include "session/merge_similarity.h"

namespace skein::messages_test {

Similarity SomeSimilarity() {
  return {2.5, Eigen::Quaterniond(1, 2, 3, 4).normalized(), {5, -6, 7}};
}

TEST(MergerMessages, SimilarityRoundTrip) {
  merge_t merge{};
  SetSimilarity(SomeSimilarity(), &merge);
  const auto got = SimilarityOf(merge);
  ASSERT_TRUE(got);
  EXPECT_EQ(got->scale, 2.5);
  EXPECT_LT(got->rotation.angularDistance(SomeSimilarity().rotation), 1e-12);
  EXPECT_EQ(got->translation, SomeSimilarity().translation);
  EXPECT_NEAR(merge.target_from_source_qwxyz[0], 1 / std::sqrt(30.0), 1e-12) << "w comes first";
}

TEST(MergerMessages, RefusesWhatIsNoSimilarity) {
  for (const double scale : {0.0, -1.0, std::numeric_limits<double>::infinity(),
                             std::numeric_limits<double>::quiet_NaN()}) {
    merge_t merge{};
    SetSimilarity(SomeSimilarity(), &merge);
    merge.target_from_source_scale = scale;
    EXPECT_FALSE(SimilarityOf(merge)) << scale;
  }
  merge_t merge{};
  merge.target_from_source_scale = 1;
  EXPECT_FALSE(SimilarityOf(merge)) << "no rotation";
}

TEST(MergerMessages, ASeedIsOneFactWhicheverPhotoComesFirst) {
  SeedChoice choice;
  choice.image_id1 = 12;
  choice.image_id2 = 3;
  choice.num_inliers = 150;
  choice.tri_angle_rad = 0.25;
  const seed_t seed = SeedMessage(choice);
  EXPECT_EQ(seed.header.fact_id, "seed/3-12");
  EXPECT_EQ(seed.image_id1, 12);
  EXPECT_EQ(seed.image_id2, 3);
  EXPECT_EQ(seed.num_inliers, 150);
  EXPECT_EQ(seed.tri_angle_rad, 0.25F);
  EXPECT_EQ(seed.submap_id, 0) << "ingest gives it";
}

}  // namespace skein::messages_test
