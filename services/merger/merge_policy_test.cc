#include "merger/merge_policy.h"

#include <gtest/gtest.h>

namespace skein {
namespace {

// Submap 1 has photos 1..10, submap 2 has 11..15 and the first `num_shared` of submap 1.
SubmapDirectory TwoSubmaps(int num_shared) {
  SubmapDirectory directory;
  directory.OnSeed(1, 1, 2);
  directory.OnSeed(2, 11, 12);
  for (int id = 1; id <= 10; ++id) directory.OnRegistered(1, id);
  for (int id = 11; id <= 15; ++id) directory.OnRegistered(2, id);
  for (int id = 1; id <= num_shared; ++id) directory.OnRegistered(2, id);
  return directory;
}

TEST(MergePolicy, ThreeSharedPhotosAreNeeded) {
  const MergePolicy policy({});
  EXPECT_FALSE(policy.Next(TwoSubmaps(2), false));
  const auto attempt = policy.Next(TwoSubmaps(3), false);
  ASSERT_TRUE(attempt);
  EXPECT_EQ(attempt->shared_images, (std::vector<int64_t>{1, 2, 3}));
}

TEST(MergePolicy, TheSmallerGoesIntoTheLarger) {
  const auto attempt = MergePolicy({}).Next(TwoSubmaps(3), false);
  ASSERT_TRUE(attempt);
  EXPECT_EQ(attempt->source_id, 2);
  EXPECT_EQ(attempt->target_id, 1);
}

TEST(MergePolicy, TheOtherWayRoundAfterAFailureThenNotWithoutNewEvidence) {
  MergePolicy policy({});
  policy.OnOrdered({100, 2, 1, 3});
  policy.OnUndone(100);
  const auto second = policy.Next(TwoSubmaps(3), false);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->source_id, 1);
  policy.OnOrdered({101, 1, 2, 3});
  policy.OnUndone(101);
  EXPECT_FALSE(policy.Next(TwoSubmaps(3), false));
  EXPECT_FALSE(policy.Next(TwoSubmaps(3), true));
  EXPECT_TRUE(policy.Next(TwoSubmaps(4), false));
}

TEST(MergePolicy, NoSimilarityCountsForBothDirections) {
  MergePolicy policy({});
  policy.OnFailed(2, 1, 3);
  EXPECT_FALSE(policy.Next(TwoSubmaps(3), false));
  EXPECT_TRUE(policy.Next(TwoSubmaps(4), false));
}

TEST(MergePolicy, AfterManyFailuresItWantsMuchMoreEvidence) {
  MergePolicy policy({});
  for (int num_shared = 3; num_shared <= 6; ++num_shared) policy.OnFailed(2, 1, num_shared);
  EXPECT_FALSE(policy.Next(TwoSubmaps(7), false));
  EXPECT_TRUE(policy.Next(TwoSubmaps(9), false));
  EXPECT_TRUE(policy.Next(TwoSubmaps(7), true));
}

TEST(MergePolicy, ASubmapTakesPartInOneMergeAtATime) {
  MergePolicy policy({});
  policy.OnOrdered({100, 3, 1, 3});
  EXPECT_FALSE(policy.Next(TwoSubmaps(5), false));
  policy.OnDone(100);
  EXPECT_TRUE(policy.Next(TwoSubmaps(5), false));
}

TEST(MergePolicy, WhenFinishingOneSharedPhotoIsWorthATry) {
  const MergePolicy policy({});
  EXPECT_FALSE(policy.Next(TwoSubmaps(0), true));
  EXPECT_TRUE(policy.Next(TwoSubmaps(1), true));
}

TEST(MergePolicy, WhatFailedBeforeTheMapsWereWorkedOverIsTriedOnceMore) {
  MergePolicy policy({});
  policy.OnFailed(2, 1, 5);
  policy.OnOrdered({100, 3, 1, 3});
  EXPECT_FALSE(policy.Next(TwoSubmaps(5), true));
  policy.OnDrained(400);
  policy.OnUndone(100);  // ordered before: its maps were not worked over
  const auto attempt = policy.Next(TwoSubmaps(5), true);
  ASSERT_TRUE(attempt);
  EXPECT_EQ(attempt->drained_seq, 400);
  policy.OnFailed(2, 1, 5);
  EXPECT_FALSE(policy.Next(TwoSubmaps(5), true));
}

TEST(MergePolicy, SwitchedOffNothingMerges) {
  MergeOptions options;
  options.enabled = false;
  EXPECT_FALSE(MergePolicy(options).Next(TwoSubmaps(5), true));
}

TEST(SubmapDirectory, AMergedSubmapsPhotosBelongToTheTarget) {
  SubmapDirectory directory = TwoSubmaps(3);
  directory.OnMerged(2, 1);
  EXPECT_EQ(directory.Live().size(), 1u);
  EXPECT_TRUE(directory.IsRegistered(15));
  EXPECT_EQ(directory.Find(1)->registered.size(), 15u);
  EXPECT_TRUE(directory.SharedPhotos().empty());
}

TEST(SubmapDirectory, AnEndedSubmapHoldsNothing) {
  SubmapDirectory directory = TwoSubmaps(0);
  directory.OnEnded(2);
  EXPECT_FALSE(directory.IsRegistered(15));
}

TEST(SubmapDirectory, WithdrawnIsNotRegistered) {
  SubmapDirectory directory = TwoSubmaps(1);
  directory.OnNotRegistered(2, 1, false);
  EXPECT_TRUE(directory.IsRegistered(1));
  directory.OnNotRegistered(1, 1, true);
  EXPECT_FALSE(directory.IsRegistered(1));
  EXPECT_TRUE(directory.IsDeferred(1));
}

}  // namespace
}  // namespace skein
