#include "merger/seed_policy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace skein {
namespace {

double Rad(double degrees) { return degrees * M_PI / 180; }

VerifiedPair Pair(int64_t other, int inliers, double angle_deg, double forward = 0.1) {
  return {other, inliers, Rad(angle_deg), forward};
}

SeedSituation Streaming(int64_t head) { return {0.0, false, head}; }
SeedSituation Quiet(int64_t head) { return {60.0, false, head}; }
SeedSituation Finishing(int64_t head) { return {0.0, true, head}; }

// Photos 1 and 2, a good pair, known of at 11.
SeedPolicy TwoOrphans() {
  SeedPolicy policy({});
  policy.OnMatches(1, 10, {});
  policy.OnMatches(2, 11, {Pair(1, 300, 20)});
  return policy;
}

TEST(SeedPolicy, TakesTheBestPairByInliersTimesAngle) {
  SeedPolicy policy({});
  policy.OnMatches(1, 10, {});
  policy.OnMatches(2, 11, {Pair(1, 200, 17)});
  policy.OnMatches(3, 12, {Pair(1, 150, 30), Pair(2, 400, 5)});
  const auto choice = policy.Choose({}, Streaming(12));
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->image_id1, 3);
  EXPECT_EQ(choice->image_id2, 1);
}

TEST(SeedPolicy, NothingIsNoSeed) {
  SeedPolicy policy({});
  EXPECT_FALSE(policy.Choose({}, Finishing(0)));
  policy.OnMatches(1, 10, {});
  EXPECT_FALSE(policy.Choose({}, Finishing(10)));
}

TEST(SeedPolicy, RefusesFewInliersAndForwardMotion) {
  SeedPolicy policy({});
  policy.OnMatches(2, 11, {Pair(1, 49, 30)});
  policy.OnMatches(3, 12, {Pair(1, 500, 30, 0.96)});
  policy.OnMatches(1, 13, {});
  EXPECT_FALSE(policy.Choose({}, Finishing(13)));
}

TEST(SeedPolicy, FewerInliersOnlyAtTheVeryEnd) {
  SeedPolicy policy({});
  policy.OnMatches(1, 10, {});
  policy.OnMatches(2, 11, {Pair(1, 60, 30)});
  EXPECT_FALSE(policy.Choose({}, Quiet(11)));
  EXPECT_TRUE(policy.Choose({}, Finishing(11)));
}

TEST(SeedPolicy, ASmallAngleWaitsWhilePhotosStream) {
  SeedPolicy policy({});
  policy.OnMatches(1, 10, {});
  policy.OnMatches(2, 11, {Pair(1, 300, 5)});
  EXPECT_FALSE(policy.Choose({}, Streaming(11)));
  EXPECT_TRUE(policy.Choose({}, Quiet(11)));
  EXPECT_TRUE(policy.Choose({}, Finishing(11)));
}

TEST(SeedPolicy, RelaxesStepByStepAsOrphansGather) {
  SeedPolicy policy({});
  policy.OnMatches(1, 10, {});
  for (int id = 2; id <= 3; ++id) policy.OnMatches(id, 10 + id, {Pair(id - 1, 300, 10)});
  EXPECT_FALSE(policy.Choose({}, Streaming(20)));
  policy.OnMatches(4, 20, {Pair(3, 300, 10)});
  EXPECT_TRUE(policy.Choose({}, Streaming(20)));
}

TEST(SeedPolicy, APhotoOfALiveSubmapIsNoOrphan) {
  SeedPolicy policy = TwoOrphans();
  SubmapDirectory directory;
  directory.OnSeed(1, 7, 8);
  directory.OnLeased(1, 1, "mapper-1");
  directory.OnStatus(1, 1, 100);
  directory.OnRegistered(1, 1);
  EXPECT_FALSE(policy.Choose(directory, Finishing(11)));
}

TEST(SeedPolicy, WaitsForAMapperThatHasNotSeenThePhotos) {
  SeedPolicy policy = TwoOrphans();
  policy.OnMatches(3, 14, {Pair(2, 300, 20)});
  policy.OnMatches(4, 15, {Pair(3, 300, 20)});
  SubmapDirectory directory;
  directory.OnSeed(1, 1, 2);
  EXPECT_FALSE(policy.Choose(directory, Finishing(15))) << "the seed is pending";
  directory.OnLeased(1, 1, "mapper-1");
  directory.OnRegistered(1, 1);
  directory.OnRegistered(1, 2);
  directory.OnStatus(1, 1, 14);
  EXPECT_FALSE(policy.Choose(directory, Finishing(15))) << "photo 4 was not looked at";
  directory.OnStatus(1, 1, 15);
  EXPECT_TRUE(policy.Choose(directory, Finishing(15)));
}

TEST(SeedPolicy, ASecondPlaceDoesNotWaitForTheFirst) {
  SeedPolicy policy = TwoOrphans();
  policy.OnMatches(3, 12, {});
  policy.OnMatches(4, 13, {Pair(3, 300, 20)});
  SubmapDirectory directory;
  directory.OnSeed(1, 1, 2);
  const auto choice = policy.Choose(directory, Streaming(13));
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->image_id2, 3);
}

TEST(SeedPolicy, ADeferredPhotoIsNotHurried) {
  SeedPolicy policy = TwoOrphans();
  SubmapDirectory directory;
  directory.OnSeed(1, 50, 51);
  directory.OnLeased(1, 1, "mapper-1");
  directory.OnStatus(1, 1, 100);
  directory.OnNotRegistered(1, 2, true);
  EXPECT_FALSE(policy.Choose(directory, Streaming(20)));
  EXPECT_TRUE(policy.Choose(directory, Quiet(20)));
  EXPECT_TRUE(policy.Choose(directory, Finishing(20)));
  for (int id = 100; id < 115; ++id) policy.OnMatches(id, id, {});
  directory.OnStatus(1, 1, 200);
  EXPECT_TRUE(policy.Choose(directory, Streaming(200)));
}

TEST(SeedPolicy, ANewEpochMustWorkItsWayUpAgain) {
  SeedPolicy policy = TwoOrphans();
  policy.OnMatches(3, 12, {Pair(2, 300, 20), Pair(1, 300, 20)});
  policy.OnMatches(4, 13, {Pair(3, 300, 20)});
  SubmapDirectory directory;
  directory.OnSeed(1, 1, 2);
  directory.OnLeased(1, 1, "mapper-1");
  directory.OnRegistered(1, 1);
  directory.OnRegistered(1, 2);
  directory.OnStatus(1, 1, 20);
  directory.OnLeased(1, 2, "mapper-2");
  directory.OnStatus(1, 1, 30);
  EXPECT_FALSE(policy.Choose(directory, Finishing(20)));
  directory.OnStatus(1, 2, 20);
  EXPECT_TRUE(policy.Choose(directory, Finishing(20)));
}

// Its submap may have been merged, and its photos withdrawn since.
TEST(SeedPolicy, ASeedIsMadeOnce) {
  SeedPolicy policy = TwoOrphans();
  SubmapDirectory directory;
  directory.OnSeed(1, 50, 51);
  directory.OnLeased(1, 1, "mapper-1");
  directory.OnStatus(1, 1, 11);
  EXPECT_TRUE(policy.Choose(directory, Finishing(11)));
  directory.OnSeed(2, 1, 2);
  directory.OnMerged(2, 1);
  EXPECT_FALSE(policy.Choose(directory, Finishing(11)));
}

TEST(SeedPolicy, ARefusedSeedIsNotTriedAgain) {
  SeedPolicy policy = TwoOrphans();
  ASSERT_TRUE(policy.Choose({}, Finishing(11)));
  policy.OnRefused(1, 2);
  EXPECT_FALSE(policy.Choose({}, Finishing(11)));
}

TEST(SeedPolicy, AFailedSeedIsNotTriedAgain) {
  SeedPolicy policy = TwoOrphans();
  SubmapDirectory directory;
  directory.OnSeed(1, 1, 2);
  directory.OnEnded(1);
  EXPECT_FALSE(policy.Choose(directory, Finishing(11)));
  policy.OnMatches(3, 12, {Pair(2, 200, 20)});
  EXPECT_TRUE(policy.Choose(directory, Finishing(12)));
}

TEST(SeedPolicy, RefusesNonsenseOptions) {
  SeedOptions options;
  options.relax_orphans = {1};
  EXPECT_THROW(SeedPolicy{options}, std::invalid_argument);
}

}  // namespace
}  // namespace skein
