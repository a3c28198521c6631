#include "merger/merge_policy.h"

#include <gtest/gtest.h>

#include "testing/test_ledger.h"

namespace skein::merge_policy_test {

// Submap 1 has photos 1..10, submap 2 has 11..15 and the first `num_shared` of submap 1.
class TwoSubmaps : public TestLedger {
 public:
  explicit TwoSubmaps(int num_shared) {
    Seed(1, 1, 2);
    Seed(2, 11, 12);
    for (int id = 1; id <= 10; ++id) Register(1, id);
    for (int id = 11; id <= 15; ++id) Register(2, id);
    Share(num_shared);
  }
  // With what was shared before.
  void Share(int num_shared) {
    for (; num_shared_ < num_shared; ++num_shared_) Register(2, num_shared_ + 1);
  }
  void OrderAndUndo(int64_t source_id, int64_t target_id) {
    MergeStep(Order(source_id, target_id, num_shared_), merge_t::UNDONE);
  }
  std::optional<MergeAttempt> Next(bool finishing, bool enabled = true) const {
    return MergePolicy(enabled).Next(SubmapDirectory(state()), finishing);
  }

 private:
  int num_shared_ = 0;
};

TEST(MergePolicy, ThreeSharedPhotosAreNeeded) {
  EXPECT_FALSE(TwoSubmaps(2).Next(false));
  const auto attempt = TwoSubmaps(3).Next(false);
  ASSERT_TRUE(attempt);
  EXPECT_EQ(attempt->images, (std::vector<int64_t>{1, 2, 3}));
}

TEST(MergePolicy, TheSmallerGoesIntoTheLarger) {
  const auto attempt = TwoSubmaps(3).Next(false);
  ASSERT_TRUE(attempt);
  EXPECT_EQ(attempt->source_id, 2);
  EXPECT_EQ(attempt->target_id, 1);
}

TEST(MergePolicy, TheOtherWayRoundAfterAFailureThenNotWithoutNewEvidence) {
  TwoSubmaps ledger(3);
  ledger.OrderAndUndo(2, 1);
  const auto second = ledger.Next(false);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->source_id, 1);
  ledger.OrderAndUndo(1, 2);
  EXPECT_FALSE(ledger.Next(false));
  EXPECT_FALSE(ledger.Next(true));
  ledger.Share(5);
  EXPECT_TRUE(ledger.Next(false));
}

// Photos of a lens that the camera model does not hold begin many such submaps: 44 photos took more
// than 200 s of merges that could add nothing.
TEST(MergePolicy, InAFinishAMapWhosePhotosALargerOneHoldsIsNotMerged) {
  TwoSubmaps ledger(3);
  ledger.Seed(3, 1, 2);
  ledger.Register(3, 1);
  ledger.Register(3, 2);
  ledger.Register(3, 3);
  ledger.OrderAndUndo(2, 1);
  ledger.OrderAndUndo(1, 2);
  EXPECT_FALSE(ledger.Next(true));
  ledger.Register(3, 16);
  EXPECT_TRUE(ledger.Next(true));
}

// A target places guests of the source, and sees none of its own photos there.
TEST(MergePolicy, TheOtherWayRoundIfTheTargetCouldNotSeeWhatAgrees) {
  TwoSubmaps ledger(0);
  const MergeAttempt attempt{2, 1, {}, 4, 0};
  const auto is_reversed = [&](const std::vector<int64_t>& inliers) {
    return MergePolicy(true).IsBetterReversed(attempt, inliers, SubmapDirectory(ledger.state()));
  };
  EXPECT_FALSE(is_reversed({11, 12, 13}));
  EXPECT_FALSE(is_reversed({1, 2, 11, 12, 13}));
  EXPECT_TRUE(is_reversed({1, 2, 3, 12}));
  EXPECT_FALSE(is_reversed({1, 2, 11, 12})) << "neither way is better";
  ledger.MergeStep(ledger.Order(1, 2, 4), merge_t::UNDONE);
  EXPECT_FALSE(is_reversed({1, 2, 3, 12})) << "that was tried";
}

TEST(MergePolicy, NoSimilarityCountsForBothDirections) {
  TwoSubmaps ledger(3);
  ledger.FailMerge(2, 1, 3);
  EXPECT_FALSE(ledger.Next(false));
  ledger.Share(5);
  EXPECT_TRUE(ledger.Next(false));
}

TEST(MergePolicy, AfterAFailureItWantsHalfAsManyPhotosMore) {
  TwoSubmaps ledger(6);
  ledger.FailMerge(2, 1, 6);
  ledger.Share(8);
  EXPECT_FALSE(ledger.Next(false));
  EXPECT_TRUE(ledger.Next(true)) << "nothing more can come";
  ledger.Share(9);
  EXPECT_TRUE(ledger.Next(false));
}

TEST(MergePolicy, PhotosThatMatchWithTheOtherSubmapAreEvidence) {
  TwoSubmaps ledger(0);
  for (int64_t id = 16; id <= 18; ++id) {
    ledger.Matches(id, {TestLedger::Pair(1, 40), TestLedger::Pair(2, 30)});
    ledger.Register(2, id);
  }
  ledger.Matches(19, {TestLedger::Pair(3, 59)});
  ledger.Register(2, 19);
  const auto attempt = ledger.Next(false);
  ASSERT_TRUE(attempt);
  EXPECT_EQ(attempt->images, (std::vector<int64_t>{1, 2, 16, 17, 18})) << "by inliers, then id";
  EXPECT_EQ(attempt->num_images, 5);
}

TEST(MergePolicy, AnAttemptLooksAtTheBestLinkedPhotosAlone) {
  TwoSubmaps ledger(1);
  for (int64_t id = 16; id <= 33; ++id) {
    ledger.Matches(id, {TestLedger::Pair(2, 50 + 10 * static_cast<int>(id))});
    ledger.Register(2, id);
  }
  const auto attempt = ledger.Next(false);
  ASSERT_TRUE(attempt);
  std::vector<int64_t> expected{1, 2};  // 1 is shared
  for (int64_t id = 33; id >= 19; --id) expected.push_back(id);
  EXPECT_EQ(attempt->images, expected);
  EXPECT_EQ(attempt->num_images, 20);
}

// One strong pair links the two: its photos have neighbours that would see points only after them.
TEST(MergePolicy, NeighboursOfLinkedPhotosFillAnAttempt) {
  TwoSubmaps ledger(0);
  ledger.Matches(16, {TestLedger::Pair(1, 93)});
  ledger.Register(2, 16);
  ledger.Matches(17, {TestLedger::Pair(16, 50), TestLedger::Pair(1, 20)});
  ledger.Register(2, 17);
  ledger.Matches(18, {TestLedger::Pair(17, 300)});
  ledger.Register(2, 18);
  ledger.Matches(19, {TestLedger::Pair(16, 40)});
  ledger.Register(2, 19);
  const auto attempt = ledger.Next(true);
  ASSERT_TRUE(attempt);
  EXPECT_EQ(attempt->images, (std::vector<int64_t>{1, 16, 17, 18, 19}));
  EXPECT_EQ(attempt->num_images, 2) << "of evidence";
}

TEST(MergePolicy, ASubmapTakesPartInOneMergeAtATime) {
  TwoSubmaps ledger(5);
  ledger.Seed(3, 31, 32);
  const int64_t merge_id = ledger.Order(3, 1);
  EXPECT_FALSE(ledger.Next(false));
  ledger.MergeStep(merge_id, merge_t::DONE);
  EXPECT_TRUE(ledger.Next(false));
}

TEST(MergePolicy, AMergeWhoseSourceIsGoneKeepsNobodyBusy) {
  TwoSubmaps ledger(5);
  ledger.Seed(3, 31, 32);
  ledger.Order(3, 1);
  EXPECT_EQ(SubmapDirectory(ledger.state()).NumOpenMerges(), 1);
  ledger.End(3);
  EXPECT_EQ(SubmapDirectory(ledger.state()).NumOpenMerges(), 0);
  EXPECT_TRUE(ledger.Next(false));
}

TEST(MergePolicy, WhenFinishingOneSharedPhotoIsWorthATry) {
  EXPECT_FALSE(TwoSubmaps(0).Next(true));
  EXPECT_TRUE(TwoSubmaps(1).Next(true));
}

TEST(MergePolicy, WhatFailedBeforeTheMapsWereWorkedOverIsTriedOnceMore) {
  TwoSubmaps ledger(5);
  ledger.Seed(3, 31, 32);
  ledger.FailMerge(2, 1, 5);
  const int64_t merge_id = ledger.Order(3, 1);
  EXPECT_FALSE(ledger.Next(true));
  const int64_t drained = ledger.Finish(finish_t::DRAINED);
  ledger.MergeStep(merge_id, merge_t::UNDONE);  // ordered before: its maps were not worked over
  const auto attempt = ledger.Next(true);
  ASSERT_TRUE(attempt);
  EXPECT_EQ(attempt->drained_seq, drained);
  ledger.FailMerge(2, 1, 5);
  EXPECT_FALSE(ledger.Next(true));
}

TEST(MergePolicy, SwitchedOffNothingMerges) { EXPECT_FALSE(TwoSubmaps(5).Next(true, false)); }

// Its photos that come with it are told of by the target, before DONE.
TEST(SubmapDirectory, OverlapsAreOfTheSessionAsItIsNow) {
  TwoSubmaps ledger(3);
  const SubmapDirectory directory(ledger.state());
  EXPECT_EQ(directory.FindOverlaps().at({1, 2}).size(), 3);
  ledger.Share(5);
  EXPECT_EQ(directory.FindOverlaps().at({1, 2}).size(), 5);
}

Overlap OverlapOf(int num_images) {
  Overlap overlap;
  overlap.shared.resize(num_images);
  return overlap;
}

TEST(MergeEvidence, IsOfTheTimeWhenEnoughPhotosFirstWereThere) {
  MergeEvidence evidence;
  evidence.Note({{{1, 2}, OverlapOf(2)}}, 10);
  EXPECT_EQ(evidence.UtimeOf(1, 2), 0);
  evidence.Note({{{1, 2}, OverlapOf(3)}}, 20);
  evidence.Note({{{1, 2}, OverlapOf(5)}}, 30);
  EXPECT_EQ(evidence.UtimeOf(2, 1), 20);
}

TEST(MergeEvidence, OfAMergesSourcePassesToItsTarget) {
  MergeEvidence evidence;
  evidence.Note({{{1, 2}, OverlapOf(3)}, {{2, 3}, OverlapOf(3)}}, 10);
  evidence.Note({{{1, 3}, OverlapOf(3)}}, 20);
  evidence.OnMerged(2, 1);
  EXPECT_EQ(evidence.UtimeOf(1, 3), 10);
  EXPECT_EQ(evidence.UtimeOf(1, 2), 0);
}

TEST(SubmapDirectory, AMergedSubmapsPhotosBelongToTheTarget) {
  TwoSubmaps ledger(3);
  const int64_t merge_id = ledger.Order(2, 1);
  for (int id = 11; id <= 15; ++id) ledger.Register(1, id);
  ledger.MergeStep(merge_id, merge_t::DONE);
  const SubmapDirectory directory(ledger.state());
  EXPECT_EQ(directory.Live().size(), 1u);
  EXPECT_TRUE(ledger.state().IsRegistered(15));
  EXPECT_EQ(ledger.state().FindSubmap(1)->num_registered, 15);
  EXPECT_TRUE(directory.FindOverlaps().empty());
}

TEST(SubmapDirectory, AnEndedSubmapHoldsNothing) {
  TwoSubmaps ledger(0);
  ledger.End(2);
  EXPECT_FALSE(ledger.state().IsRegistered(15));
}

TEST(SubmapDirectory, WithdrawnIsNotRegistered) {
  TwoSubmaps ledger(1);
  ledger.Register(2, 1, registration_t::REJECTED);
  EXPECT_TRUE(ledger.state().IsRegistered(1));
  EXPECT_FALSE(SubmapDirectory(ledger.state()).IsDeferred(1));
  ledger.Register(1, 1, registration_t::WITHDRAWN);
  EXPECT_FALSE(ledger.state().IsRegistered(1));
  EXPECT_TRUE(SubmapDirectory(ledger.state()).IsDeferred(1));
}

}  // namespace skein::merge_policy_test
