#include "mapper/offered_photos.h"

#include <gtest/gtest.h>

#include "testing/test_ledger.h"

namespace skein::offered_photos_test {

constexpr int64_t kUs = 1, kOther = 2;
constexpr int64_t kOurPhoto = 10, kTheirPhoto = 20, kNew = 30;

// We hold kOurPhoto, another submap kTheirPhoto and two more; kNew matches with both.
class OfferedPhotosTest : public testing::Test {
 protected:
  OfferedPhotosTest() {
    ledger_.Seed(kUs, kOurPhoto, 11);
    ledger_.Seed(kOther, kTheirPhoto, 21);
    ledger_.Photo(kOurPhoto);
    ledger_.Photo(kTheirPhoto);
    Register(kUs, kOurPhoto);
    for (const int64_t id : {kTheirPhoto, int64_t{21}, int64_t{22}}) Register(kOther, id);
    photos_.TakeHeldChanges();
  }
  void MatchNew(int inliers_with_ours, int inliers_with_theirs) {
    ledger_.Matches(kNew, {TestLedger::Pair(kOurPhoto, inliers_with_ours),
                           TestLedger::Pair(kTheirPhoto, inliers_with_theirs)});
  }
  // As the run is told of it.
  void Register(int64_t submap_id, int64_t image_id, int8_t state = registration_t::REGISTERED) {
    ledger_.Register(submap_id, image_id, state);
    registration_t fact{};
    fact.submap_id = submap_id;
    fact.image_id = image_id;
    fact.state = state;
    photos_.OnFact(fact);
  }
  std::vector<int64_t> Ours() { return photos_.TakeOurs(); }

  TestLedger ledger_;
  OfferedPhotos photos_{ledger_.state(), kUs, true};
};

using Ids = std::vector<int64_t>;

TEST_F(OfferedPhotosTest, APhotoIsOfTheSubmapThatItOverlapsMost) {
  MatchNew(80, 50);
  photos_.Offer(kNew);
  EXPECT_EQ(Ours(), Ids{kNew});
  EXPECT_TRUE(Ours().empty()) << "once";
}

TEST_F(OfferedPhotosTest, APhotoWaitsWhileAnotherSubmapIsItsHome) {
  MatchNew(50, 80);
  photos_.Offer(kNew);
  EXPECT_TRUE(Ours().empty());
}

TEST_F(OfferedPhotosTest, WhatItsHomeTurnsDownIsOurs) {
  MatchNew(50, 80);
  photos_.Offer(kNew);
  Register(kOther, kNew, registration_t::DEFERRED);
  EXPECT_EQ(Ours(), Ids{kNew});
}

TEST_F(OfferedPhotosTest, WhatItsHomeTakesIsHeldElsewhereUntilItIsWithdrawn) {
  MatchNew(50, 80);
  photos_.Offer(kNew);
  Register(kOther, kNew);
  EXPECT_TRUE(Ours().empty());
  using Held = std::vector<std::pair<int64_t, bool>>;
  EXPECT_EQ(photos_.TakeHeldChanges(), (Held{{kNew, true}}));
  Register(kOther, kNew, registration_t::WITHDRAWN);
  EXPECT_EQ(Ours(), Ids{kNew});
  EXPECT_EQ(photos_.TakeHeldChanges(), (Held{{kNew, false}}));
}

TEST_F(OfferedPhotosTest, MoreSupportMakesItsHomeOurs) {
  MatchNew(50, 80);
  photos_.Offer(kNew);
  ledger_.Matches(11, {TestLedger::Pair(kNew, 60)});
  Register(kUs, 11);
  EXPECT_EQ(Ours(), Ids{kNew});
}

TEST_F(OfferedPhotosTest, TheEndOfItsHomeMakesItOurs) {
  MatchNew(50, 80);
  photos_.Offer(kNew);
  ledger_.End(kOther);
  submap_end_t end{};
  end.submap_id = kOther;
  photos_.OnFact(end);
  EXPECT_EQ(Ours(), Ids{kNew});
}

// An initial pair may be wrong.
TEST_F(OfferedPhotosTest, APairHoldsNoPhotoAThirdMakesItAMap) {
  constexpr int64_t kPair = 3;
  ledger_.Seed(kPair, kNew, 31);
  MatchNew(50, 10);
  ledger_.Matches(31, {TestLedger::Pair(kNew, 500)});
  photos_.Offer(kNew);
  EXPECT_EQ(Ours(), Ids{kNew});
  Register(kPair, kNew);
  Register(kPair, 31);
  EXPECT_TRUE(photos_.TakeHeldChanges().empty());
  Register(kPair, 32);
  using Held = std::vector<std::pair<int64_t, bool>>;
  EXPECT_EQ(photos_.TakeHeldChanges(), (Held{{kNew, true}, {31, true}, {32, true}}));
  Register(kPair, 32, registration_t::WITHDRAWN);
  EXPECT_EQ(photos_.TakeHeldChanges(), (Held{{kNew, false}, {31, false}, {32, false}}));
}

TEST_F(OfferedPhotosTest, WithoutSupportInTheLedgerItIsOursAtOnce) {
  ledger_.Photo(kNew);
  photos_.Offer(kNew);
  EXPECT_EQ(Ours(), Ids{kNew}) << "our registrations are on their way";
}

TEST_F(OfferedPhotosTest, WithoutHomesEverySubmapTries) {
  MatchNew(50, 80);
  OfferedPhotos photos(ledger_.state(), kUs, false);
  photos.Offer(kNew);
  EXPECT_EQ(photos.TakeOurs(), Ids{kNew});
}

}  // namespace skein::offered_photos_test
