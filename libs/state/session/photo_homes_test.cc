#include "session/photo_homes.h"

#include <gtest/gtest.h>

#include "testing/test_ledger.h"

namespace skein::photo_homes_test {

// Photos 1 to 6 are a chain of pairs; 7 and 8 are a pair of another place.
class PhotoHomesTest : public testing::Test {
 protected:
  PhotoHomesTest() {
    ledger_.Matches(1, {});
    for (int64_t id = 2; id <= 6; ++id) ledger_.Matches(id, {TestLedger::Pair(id - 1)});
    ledger_.Matches(7, {});
    ledger_.Matches(8, {TestLedger::Pair(7)});
  }
  void AddSubmap(int64_t submap_id, int64_t first, int64_t last) {
    ledger_.Seed(submap_id, first, last);
    for (int64_t id = first; id <= last; ++id) ledger_.Register(submap_id, id);
  }
  int64_t LargerNeighbourOf(int64_t submap_id) const {
    return LargerNeighbour(ledger_.state(), submap_id);
  }

  TestLedger ledger_;
};

TEST_F(PhotoHomesTest, OnlyTheSmallerOfTwoMapsOfOnePlaceHasALargerNeighbour) {
  AddSubmap(1, 1, 2);
  AddSubmap(2, 3, 6);
  EXPECT_EQ(LargerNeighbourOf(1), 2);
  EXPECT_EQ(LargerNeighbourOf(2), 0);
}

TEST_F(PhotoHomesTest, OfEqualNeighboursTheOlderCountsAsLarger) {
  AddSubmap(1, 1, 2);
  AddSubmap(2, 3, 4);
  EXPECT_EQ(LargerNeighbourOf(1), 0);
  EXPECT_EQ(LargerNeighbourOf(2), 1);
}

TEST_F(PhotoHomesTest, AMapOfTheSamePhotosIsANeighbour) {
  AddSubmap(1, 7, 8);
  AddSubmap(2, 7, 8);
  EXPECT_EQ(LargerNeighbourOf(2), 1);
}

TEST_F(PhotoHomesTest, AMapOfAnotherPlaceOrOneThatEndedIsNoNeighbour) {
  AddSubmap(1, 1, 4);
  AddSubmap(2, 7, 8);
  EXPECT_EQ(LargerNeighbourOf(2), 0);
  AddSubmap(3, 5, 6);
  EXPECT_EQ(LargerNeighbourOf(3), 1);
  ledger_.End(1);
  EXPECT_EQ(LargerNeighbourOf(3), 0);
}

// Photo 3 lies between them, and neither has it.
TEST_F(PhotoHomesTest, AMapBeyondAPhotoThatNeitherHoldsIsNoNeighbour) {
  AddSubmap(1, 4, 6);
  AddSubmap(2, 1, 2);
  EXPECT_EQ(LargerNeighbourOf(2), 0);
}

}  // namespace skein::photo_homes_test
