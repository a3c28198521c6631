#include "merger/seed_policy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "session/submap_steps.h"
#include "testing/test_ledger.h"

namespace skein::seed_policy_test {

two_view_t Pair(int64_t other, int inliers, double angle_deg, double forward = 0.1) {
  return TestLedger::Pair(other, inliers, static_cast<float>(angle_deg * M_PI / 180),
                          static_cast<float>(forward));
}

// A ledger, what the mappers tell beside it, and the policy.
class SeedPolicyTest : public testing::Test {
 protected:
  // Photos 1 and 2, a good pair.
  void TwoOrphans() {
    ledger_.Matches(1, {});
    ledger_.Matches(2, {Pair(1, 300, 20)});
  }
  // Its mapper has worked up to the ledger's end.
  void Tell(int64_t submap_id, int64_t epoch) { Tell(submap_id, epoch, ledger_.head()); }
  void Tell(int64_t submap_id, int64_t epoch, int64_t ledger_seq) {
    directory_.OnStatus(submap_id, epoch, ledger_seq);
  }
  std::optional<SeedChoice> Streaming() const { return Choose(0, false); }
  std::optional<SeedChoice> Quiet(double quiet_s = 60) const { return Choose(quiet_s, false); }
  std::optional<SeedChoice> Finishing() const { return Choose(0, true); }

  TestLedger ledger_;
  SubmapDirectory directory_{ledger_.state()};
  SeedPolicy policy_;

 private:
  std::optional<SeedChoice> Choose(double quiet_s, bool finishing) const {
    return policy_.Choose(directory_, {quiet_s, finishing, ledger_.head()});
  }
};

TEST_F(SeedPolicyTest, TakesTheBestPairByInliersTimesAngle) {
  ledger_.Matches(1, {});
  ledger_.Matches(2, {Pair(1, 200, 17)});
  ledger_.Matches(3, {Pair(1, 150, 30), Pair(2, 400, 5)});
  const auto choice = Streaming();
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->image_id1, 3);
  EXPECT_EQ(choice->image_id2, 1);
}

TEST_F(SeedPolicyTest, PhotosOfOneSpotAreNoSeedWhateverAWeakPairSays) {
  two_view_t turned = Pair(1, 600, 0);
  turned.geometry = CovisibilityGraph::Edge::kPanoramic;
  ledger_.Matches(1, {});
  ledger_.Matches(2, {turned});
  ledger_.Matches(3, {Pair(1, 200, 17)});
  EXPECT_TRUE(Finishing());
  TestLedger with_all;
  with_all.Matches(1, {});
  with_all.Matches(2, {turned});
  turned.other_id = 2;
  with_all.Matches(3, {Pair(1, 200, 17), turned});
  const SubmapDirectory directory(with_all.state());
  EXPECT_FALSE(policy_.Choose(directory, {0, true, with_all.head()}));
}

TEST_F(SeedPolicyTest, NothingIsNoSeed) {
  EXPECT_FALSE(Finishing());
  ledger_.Matches(1, {});
  EXPECT_FALSE(Finishing());
}

TEST_F(SeedPolicyTest, RefusesFewInliers) {
  ledger_.Matches(2, {Pair(1, 49, 30)});
  ledger_.Matches(1, {});
  EXPECT_FALSE(Finishing());
}

TEST_F(SeedPolicyTest, ForwardMotionWaitsUntilAllLimitsAreRelaxed) {
  ledger_.Matches(1, {});
  ledger_.Matches(2, {Pair(1, 500, 30, 0.99)});
  EXPECT_FALSE(Streaming());
  EXPECT_TRUE(Quiet(9));
  EXPECT_TRUE(Finishing());
  ledger_.Matches(3, {Pair(1, 100, 2.5)});
  const auto choice = Finishing();
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->image_id1, 3);  // another pair comes first, however small its angle
}

// A submap whose mapper failed at photo 1 three times has ended.
TEST_F(SeedPolicyTest, APhotoThatMappersFailAtBeginsNoOther) {
  ledger_.Matches(1, {});
  ledger_.Matches(2, {Pair(1, 400, 20)});
  ledger_.Matches(3, {Pair(1, 400, 20), Pair(2, 200, 20)});
  ledger_.Seed(1, 1, 2);
  failure_t failure{};
  failure.stage = "submap";
  failure.submap_id = 1;
  failure.step = PhotoStep(1);
  failure.attempts = 3;
  failure.parked = 1;
  ledger_.Commit(failure);
  ledger_.End(1);
  const auto choice = Streaming();
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->image_id1, 3);
  EXPECT_EQ(choice->image_id2, 2);
}

TEST_F(SeedPolicyTest, FewerInliersOnlyAtTheVeryEnd) {
  ledger_.Matches(1, {});
  ledger_.Matches(2, {Pair(1, 60, 30)});
  EXPECT_FALSE(Quiet());
  EXPECT_TRUE(Finishing());
}

TEST_F(SeedPolicyTest, ASmallAngleWaitsWhilePhotosStream) {
  ledger_.Matches(1, {});
  ledger_.Matches(2, {Pair(1, 300, 5)});
  EXPECT_FALSE(Streaming());
  EXPECT_TRUE(Quiet());
  EXPECT_TRUE(Finishing());
}

// As in a hand-held video: each frame sees the first under a larger angle, until it sees it no
// more.
TEST_F(SeedPolicyTest, ASmallAngleWaitsWhilePhotosBringLargerOnes) {
  ledger_.Matches(1, {});
  for (int id = 2; id <= 11; ++id) {
    ledger_.Matches(id, {Pair(1, 300, id)});
    EXPECT_FALSE(Streaming()) << id;
  }
  for (int id = 12; id <= 14; ++id) {
    ledger_.Matches(id, {Pair(id - 1, 300, 2)});
    EXPECT_FALSE(Streaming()) << id;
  }
  ledger_.Matches(15, {Pair(14, 300, 2)});
  const auto choice = Streaming();
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->image_id1, 11);
  EXPECT_EQ(choice->image_id2, 1);
}

TEST_F(SeedPolicyTest, PhotosOfAnotherPlaceDoNotHurryASmallAngle) {
  ledger_.Matches(1, {});
  ledger_.Matches(2, {Pair(1, 300, 10)});
  ledger_.Matches(3, {});
  for (int id = 4; id <= 8; ++id) ledger_.Matches(id, {Pair(id - 1, 90, 1)});
  EXPECT_FALSE(Streaming());
}

TEST_F(SeedPolicyTest, APhotoOfALiveSubmapIsNoOrphan) {
  TwoOrphans();
  ledger_.Seed(1, 7, 8);
  ledger_.Lease(1, 1);
  ledger_.Register(1, 1);
  Tell(1, 1);
  EXPECT_FALSE(Finishing());
}

TEST_F(SeedPolicyTest, WaitsForAMapperThatHasNotSeenThePhotos) {
  TwoOrphans();
  const int64_t third = ledger_.Matches(3, {Pair(2, 300, 20)});
  const int64_t fourth = ledger_.Matches(4, {Pair(3, 300, 20)});
  ledger_.Seed(1, 1, 2);
  EXPECT_FALSE(Finishing()) << "the seed is pending";
  ledger_.Lease(1, 1);
  ledger_.Register(1, 1);
  ledger_.Register(1, 2);
  Tell(1, 1, third);
  EXPECT_FALSE(Finishing()) << "photo 4 was not looked at";
  Tell(1, 1, fourth);
  EXPECT_TRUE(Finishing());
}

TEST_F(SeedPolicyTest, ASecondPlaceDoesNotWaitForTheFirst) {
  TwoOrphans();
  ledger_.Matches(3, {});
  ledger_.Matches(4, {Pair(3, 300, 20)});
  ledger_.Seed(1, 1, 2);
  const auto choice = Streaming();
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->image_id2, 3);
}

TEST_F(SeedPolicyTest, ADeferredPhotoIsNotHurried) {
  TwoOrphans();
  ledger_.Seed(1, 50, 51);
  ledger_.Lease(1, 1);
  ledger_.Register(1, 2, registration_t::DEFERRED);
  Tell(1, 1);
  EXPECT_FALSE(Streaming());
  EXPECT_TRUE(Quiet());
  EXPECT_TRUE(Finishing());
  for (int id = 100; id < 115; ++id) ledger_.Matches(id, {});
  Tell(1, 1);
  EXPECT_TRUE(Streaming());
}

TEST_F(SeedPolicyTest, ANewEpochMustWorkItsWayUpAgain) {
  TwoOrphans();
  ledger_.Matches(3, {Pair(2, 300, 20), Pair(1, 300, 20)});
  ledger_.Matches(4, {Pair(3, 300, 20)});
  ledger_.Seed(1, 1, 2);
  ledger_.Lease(1, 1);
  ledger_.Register(1, 1);
  ledger_.Register(1, 2);
  Tell(1, 1);
  ledger_.Lease(1, 2, "mapper-2");
  Tell(1, 1, ledger_.head() + 10);
  EXPECT_FALSE(Finishing()) << "the former mapper's word is void";
  Tell(1, 2);
  EXPECT_TRUE(Finishing());
}

// Its submap may have been merged, and its photos withdrawn since.
TEST_F(SeedPolicyTest, ASeedIsMadeOnce) {
  TwoOrphans();
  ledger_.Seed(1, 50, 51);
  ledger_.Lease(1, 1);
  Tell(1, 1);
  EXPECT_TRUE(Finishing());
  ledger_.Seed(2, 1, 2);
  ledger_.MergeStep(ledger_.Order(2, 1), merge_t::DONE);
  EXPECT_FALSE(Finishing());
}

TEST_F(SeedPolicyTest, ARefusedSeedIsNotTriedAgain) {
  TwoOrphans();
  ASSERT_TRUE(Finishing());
  policy_.OnRefused(1, 2);
  EXPECT_FALSE(Finishing());
}

// It may have been withdrawn from that submap. Ingest would refuse the pair.
TEST_F(SeedPolicyTest, APhotoOfALiveSubmapsInitialPairWaitsForItsEnd) {
  TwoOrphans();
  ledger_.Seed(1, 1, 50);
  ledger_.Lease(1, 1);
  Tell(1, 1);
  EXPECT_FALSE(Finishing());
  ledger_.End(1);
  EXPECT_TRUE(Finishing());
}

TEST_F(SeedPolicyTest, AFailedSeedIsNotTriedAgain) {
  TwoOrphans();
  ledger_.Seed(1, 1, 2);
  ledger_.End(1);
  EXPECT_FALSE(Finishing());
  ledger_.Matches(3, {Pair(2, 200, 20)});
  EXPECT_TRUE(Finishing());
}

}  // namespace skein::seed_policy_test
