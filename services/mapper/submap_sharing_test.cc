#include "mapper/submap_sharing.h"

#include <gtest/gtest.h>

#include <string>

namespace skein::submap_sharing_test {

using Load = SubmapSharing::Load;

// A mapper of a pool in which the test is everyone else. What is told is repeated as on the bus.
class SubmapSharingTest : public testing::Test {
 protected:
  void Wait(const std::string& author, int num_waiting) {
    demand_t demand{};
    demand.author = author;
    demand.kind = "submap";
    demand.num_waiting = num_waiting;
    sharing_.OnDemand(demand, now_s_);
  }
  void Ask(const std::string& mapper, int capacity) {
    work_request_t request{};
    request.worker = mapper;
    request.kind = "submap";
    request.capacity = capacity;
    sharing_.OnRequest(request, now_s_);
  }
  // For how long `author`'s item waits until this mapper offers, up to a minute.
  double OffersAfterS(const Load& load, const std::string& author = "merger") {
    const double start_s = now_s_;
    for (; now_s_ < start_s + 60; now_s_ += 0.1) {
      Wait(author, 1);
      if (sharing_.Offers(load, now_s_)) break;
    }
    return now_s_ - start_s;
  }

  double now_s_ = 100;
  SubmapSharing sharing_{3, 4};
};

TEST_F(SubmapSharingTest, OffersOnceNoMapperWasIdleForAWhile) {
  EXPECT_NEAR(OffersAfterS({1, 0}), 4, 0.11);
}

TEST_F(SubmapSharingTest, OffersNothingWhileNothingWaits) {
  Wait("merger", 0);
  EXPECT_FALSE(sharing_.Offers({1, 10}, now_s_));
  EXPECT_FALSE(sharing_.Offers({1, 10}, now_s_ + 60));
}

TEST_F(SubmapSharingTest, LeavesWhatWaitsToAnIdleMapper) {
  for (; now_s_ < 160; now_s_ += 0.5) {
    Wait("merger", 1);
    Ask("mapper-2", 1);
    EXPECT_FALSE(sharing_.Offers({1, 10}, now_s_));
  }
}

TEST_F(SubmapSharingTest, AMapperWithoutASubmapIsIdleAnyway) {
  EXPECT_NEAR(OffersAfterS({0, 0}), 60, 0.11);
}

TEST_F(SubmapSharingTest, WaitsTheLongerTheMorePhotosItHoldsUpToTwiceAsLong) {
  EXPECT_NEAR(OffersAfterS({2, 100}), 6, 0.11);
  sharing_.OnTaken();
  const double with_very_many_s = OffersAfterS({1, 100000});
  EXPECT_GT(with_very_many_s, 7.5);
  EXPECT_LT(with_very_many_s, 8.2);
}

TEST_F(SubmapSharingTest, AnOfferStandsUntilItIsTaken) {
  OffersAfterS({1, 0});
  Ask("mapper-1", 1);  // its own
  Wait("merger", 0);   // which will make the seed
  now_s_ += 4;
  EXPECT_TRUE(sharing_.Offers({1, 0}, now_s_));
  sharing_.OnTaken();
  EXPECT_FALSE(sharing_.Offers({2, 2}, now_s_));
}

TEST_F(SubmapSharingTest, AnOfferThatNobodyNeedsEnds) {
  OffersAfterS({1, 0});
  Wait("merger", 0);
  EXPECT_FALSE(sharing_.Offers({1, 0}, now_s_ + 6));
}

TEST_F(SubmapSharingTest, TakesNoSeedBeyondItsLimit) {
  EXPECT_LT(OffersAfterS({2, 0}), 5);
  sharing_.OnTaken();
  EXPECT_NEAR(OffersAfterS({3, 0}), 60, 0.11);
}

// As after a restart of the session with fewer mappers.
TEST_F(SubmapSharingTest, TakesWhatExistsBeyondItsLimit) {
  EXPECT_LT(OffersAfterS({3, 0}, "ingest"), 5);
}

}  // namespace skein::submap_sharing_test
