#include "session/places.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "testing/test_ledger.h"

namespace skein::places_test {

// Photos 1 to 6 are a chain of pairs. 7 has a pair with 6 that is too weak to register it.
class PlacesTest : public testing::Test {
 protected:
  PlacesTest() {
    ledger_.Matches(1, {});
    for (int64_t id = 2; id <= 6; ++id) ledger_.Matches(id, {TestLedger::Pair(id - 1)});
    ledger_.Matches(7, {TestLedger::Pair(6, 20)});
  }
  void AddSubmap(int64_t submap_id, int64_t first, int64_t last) {
    ledger_.Seed(submap_id, first, last);
    for (int64_t id = first; id <= last; ++id) ledger_.Register(submap_id, id);
  }
  std::vector<Place> Find() const { return FindPlaces(ledger_.state()); }

  TestLedger ledger_;
};

TEST_F(PlacesTest, APlaceHasThePhotosThatPairsConnect) {
  const std::vector<Place> places = Find();
  ASSERT_EQ(places.size(), 2u);
  EXPECT_EQ(places[0].photos.size() + places[1].photos.size(), 7u);
  EXPECT_EQ(std::max(places[0].photos.size(), places[1].photos.size()), 6u);
}

TEST_F(PlacesTest, OfOneMapIsNotDivided) {
  AddSubmap(1, 1, 5);
  EXPECT_FALSE(HasDividedPlace(Find()));
  EXPECT_FALSE(IsOfDividedPlace(Find(), 1));
  EXPECT_EQ(FindDividedPlace(Find(), 1), nullptr);
}

TEST_F(PlacesTest, OfTwoMapsIsTheLargerOnes) {
  AddSubmap(1, 1, 2);
  AddSubmap(2, 3, 6);
  const std::vector<Place> places = Find();
  EXPECT_TRUE(HasDividedPlace(places));
  EXPECT_TRUE(IsOfDividedPlace(places, 1) && IsOfDividedPlace(places, 2));
  EXPECT_FALSE(IsOfDividedPlace(places, 3));
  EXPECT_EQ(FindDividedPlace(places, 1), nullptr);
  const Place* place = FindDividedPlace(places, 2);
  ASSERT_NE(place, nullptr);
  EXPECT_EQ(place->submaps, (std::vector<int64_t>{2, 1}));
}

TEST_F(PlacesTest, AMapThatHasEndedCountsNoMore) {
  AddSubmap(1, 1, 2);
  AddSubmap(2, 3, 6);
  ledger_.End(1);
  EXPECT_FALSE(HasDividedPlace(Find()));
}

TEST_F(PlacesTest, AMapOfASimilarPlaceStaysOut) {
  AddSubmap(1, 1, 2);
  AddSubmap(2, 3, 6);
  merge_t undone = ledger_.state().FindMerge(ledger_.Order(1, 2))->ordered();
  undone.header = {};
  undone.state = merge_t::UNDONE;
  undone.similar_places = 1;
  ledger_.Commit(undone);
  EXPECT_FALSE(HasDividedPlace(Find()));
  const std::vector<Place> places = Find();
  const auto place = std::find_if(places.begin(), places.end(),
                                  [](const Place& found) { return !found.submaps.empty(); });
  ASSERT_NE(place, places.end());
  EXPECT_EQ(place->photos, (std::vector<int64_t>{3, 4, 5, 6}));
}

}  // namespace skein::places_test
