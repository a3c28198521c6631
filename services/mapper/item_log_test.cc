#include "mapper/item_log.h"

#include <gtest/gtest.h>

#include <utility>

namespace skein::item_log_test {

class ItemLogTest : public testing::Test {
 protected:
  // The next fact of the ledger; returns its seq.
  template <class T>
  int64_t Take(T fact) {
    fact.header.seq = ++seq_;
    log_.Take(fact);
    return seq_;
  }
  int64_t TakeMatches(int64_t image_id) {
    matches_t matches{};
    matches.image_id = image_id;
    return Take(matches);
  }
  int64_t TakeMerge(int64_t merge_id, int8_t state) {
    merge_t merge{};
    merge.merge_id = merge_id;
    merge.state = state;
    return Take(merge);
  }
  int64_t TakeFinish(int8_t state) {
    finish_t finish{};
    finish.finish_id = 5;
    finish.state = state;
    return Take(finish);
  }

  int64_t seq_ = 0;
  ItemLog log_;
  ItemCursor cursor_{log_};
};

TEST_F(ItemLogTest, ListsWhatASubmapWorksThroughInOrder) {
  using Kind = Item::Kind;
  const int64_t matches = TakeMatches(1);
  TakeFinish(finish_t::REQUESTED);
  const int64_t drained = TakeFinish(finish_t::DRAINED);
  const int64_t ordered = TakeMerge(0, merge_t::ORDERED);
  TakeMerge(ordered, merge_t::FROZEN);
  TakeMerge(ordered, merge_t::DONE);
  const int64_t settled = TakeFinish(finish_t::SETTLED);
  TakeFinish(finish_t::DONE);
  Take(registration_t{});
  const auto& items = log_.items();
  ASSERT_EQ(items.size(), 3u);
  const std::pair<Kind, int64_t> expected[] = {
      {Kind::kMatches, matches}, {Kind::kDrained, drained}, {Kind::kSettled, settled}};
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(items[i].kind, expected[i].first) << i;
    EXPECT_EQ(items[i].seq, expected[i].second) << i;
  }
  EXPECT_EQ(items[0].id, 1);
  ASSERT_EQ(log_.merges().size(), 1u);
  EXPECT_EQ(log_.merges()[0], ordered) << "an order's seq is its merge's id";
}

TEST_F(ItemLogTest, AMergeWaitsForNoOtherItem) {
  TakeMatches(7);
  TakeMatches(8);
  cursor_.Next();
  cursor_.Close();
  const int64_t ordered = TakeMerge(0, merge_t::ORDERED);
  EXPECT_EQ(cursor_.NextMerge(), ordered);
  EXPECT_EQ(cursor_.seq(), 1) << "the second photo is not worked in";
  EXPECT_EQ(cursor_.merge_seq(), ordered);
  EXPECT_FALSE(cursor_.NextMerge());
  EXPECT_EQ(cursor_.Next()->id, 8);
  EXPECT_FALSE(cursor_.Next());
}

TEST_F(ItemLogTest, AMergeThatACheckpointKnowsIsNotOpenedAgain) {
  TakeMatches(7);
  const int64_t ordered = TakeMerge(0, merge_t::ORDERED);
  cursor_.StartAfter(0, ordered);
  EXPECT_FALSE(cursor_.NextMerge());
  EXPECT_EQ(cursor_.Next()->id, 7);
}

TEST_F(ItemLogTest, ACursorOpensItemsInOrderAsTheyCome) {
  EXPECT_FALSE(cursor_.Next());
  TakeMatches(7);
  TakeMatches(8);
  EXPECT_EQ(cursor_.num_left(), 2);
  EXPECT_EQ(cursor_.Next()->id, 7);
  EXPECT_EQ(cursor_.Next()->id, 8);
  EXPECT_FALSE(cursor_.Next());
  TakeMatches(9);
  EXPECT_EQ(cursor_.Next()->id, 9);
}

TEST_F(ItemLogTest, AnOpenItemIsNotDone) {
  TakeMatches(7);
  cursor_.Next();
  EXPECT_EQ(cursor_.seq(), 1);
  EXPECT_EQ(cursor_.done_seq(), 0);
  cursor_.Close();
  EXPECT_EQ(cursor_.done_seq(), 1);
  cursor_.SkipTo(5);
  EXPECT_EQ(cursor_.done_seq(), 5);
  cursor_.SkipTo(3);
  EXPECT_EQ(cursor_.done_seq(), 5);
}

TEST_F(ItemLogTest, ACursorStartsBehindWhatACheckpointKnows) {
  for (int64_t id = 1; id <= 4; ++id) TakeMatches(id);
  cursor_.StartAfter(2, 2);
  EXPECT_EQ(cursor_.done_seq(), 1) << "what came with it is still worked on";
  EXPECT_TRUE(cursor_.HasReached(2));
  EXPECT_FALSE(cursor_.HasReached(3));
  EXPECT_EQ(cursor_.Next()->id, 3);
  EXPECT_TRUE(cursor_.HasReached(3));
  cursor_.Next();
  EXPECT_TRUE(cursor_.HasReached(100)) << "all that there is";
}

}  // namespace skein::item_log_test
