#include "mapper/ledger_index.h"

#include <gtest/gtest.h>

namespace skein {
namespace {

class LedgerIndexTest : public testing::Test {
 protected:
  // The next fact of the ledger; returns its seq.
  template <class T>
  int64_t Take(T fact) {
    fact.header.seq = ++seq_;
    index_.Take(fact);
    return seq_;
  }
  int64_t TakeMatches(int64_t image_id, const std::vector<int64_t>& others) {
    matches_t matches{};
    matches.image_id = image_id;
    for (const int64_t other : others) {
      two_view_t pair{};
      pair.other_id = other;
      matches.pairs.push_back(pair);
    }
    matches.num_pairs = static_cast<int32_t>(others.size());
    return Take(matches);
  }
  int64_t TakeSubmap(int64_t submap_id, int8_t state, int64_t epoch = 1) {
    submap_t submap{};
    submap.submap_id = submap_id;
    submap.state = state;
    submap.epoch = epoch;
    return Take(submap);
  }
  int64_t TakeMerge(int64_t merge_id, int8_t state) {
    merge_t merge{};
    merge.merge_id = merge_id;
    merge.state = state;
    return Take(merge);
  }
  void TakeRegistration(int64_t image_id, int64_t submap_id, int64_t epoch, int8_t state) {
    registration_t registration{};
    registration.image_id = image_id;
    registration.submap_id = submap_id;
    registration.epoch = epoch;
    registration.state = state;
    Take(registration);
  }

  int64_t seq_ = 0;
  LedgerIndex index_;
};

TEST_F(LedgerIndexTest, KnowsNothingAtFirst) {
  EXPECT_EQ(index_.FindImage(1), nullptr);
  EXPECT_EQ(index_.FindFeatures(1), nullptr);
  EXPECT_EQ(index_.FindCandidates(1), nullptr);
  EXPECT_EQ(index_.FindMatches(1), nullptr);
  EXPECT_EQ(index_.FindSeed(1), nullptr);
  EXPECT_EQ(index_.FindModel(1), nullptr);
  EXPECT_EQ(index_.FindLease(1), nullptr);
  EXPECT_FALSE(index_.HasEnded(1));
  EXPECT_TRUE(index_.FindMerge(1).empty());
  EXPECT_TRUE(index_.Neighbours(1).empty());
  EXPECT_TRUE(index_.RegisteredIn(1).empty());
  EXPECT_EQ(index_.CountRegistrations(1, 1, 1), 0);
}

TEST_F(LedgerIndexTest, FindsThePartsOfAPhoto) {
  image_t image{};
  image.image_id = 7;
  image.name = "a.jpg";
  features_t features{};
  features.image_id = 7;
  features.num_keypoints = 3;
  candidates_t candidates{};
  candidates.image_id = 7;
  seed_t seed{};
  seed.submap_id = 2;
  seed.image_id1 = 7;
  Take(image);
  Take(features);
  Take(candidates);
  Take(seed);
  TakeMatches(7, {});
  EXPECT_EQ(index_.FindImage(7)->name, "a.jpg");
  EXPECT_EQ(index_.FindFeatures(7)->num_keypoints, 3);
  EXPECT_NE(index_.FindCandidates(7), nullptr);
  EXPECT_NE(index_.FindMatches(7), nullptr);
  EXPECT_EQ(index_.FindSeed(2)->image_id1, 7);
  EXPECT_EQ(index_.FindImage(2), nullptr);
}

TEST_F(LedgerIndexTest, APairMakesBothPhotosNeighboursFromThenOn) {
  TakeMatches(1, {});
  const int64_t second = TakeMatches(2, {1});
  const int64_t third = TakeMatches(3, {1, 2});
  EXPECT_EQ(index_.Neighbours(1), (std::map<int64_t, int64_t>{{2, second}, {3, third}}));
  EXPECT_EQ(index_.Neighbours(2), (std::map<int64_t, int64_t>{{1, second}, {3, third}}));
  EXPECT_EQ(index_.Neighbours(3), (std::map<int64_t, int64_t>{{1, third}, {2, third}}));
}

TEST_F(LedgerIndexTest, APairFoundFromBothSidesIsKnownSinceTheFirst) {
  const int64_t first = TakeMatches(1, {2});
  TakeMatches(2, {1});
  EXPECT_EQ(index_.Neighbours(1).at(2), first);
  EXPECT_EQ(index_.Neighbours(2).at(1), first);
}

TEST_F(LedgerIndexTest, KeepsTheFactsOfAMerge) {
  const int64_t merge_id = TakeMerge(0, merge_t::ORDERED);
  TakeMerge(merge_id, merge_t::FROZEN);
  TakeMerge(merge_id, merge_t::UNDONE);
  ASSERT_EQ(index_.FindMerge(merge_id).size(), 3u);
  EXPECT_EQ(index_.FindMerge(merge_id).front().state, +merge_t::ORDERED);
  EXPECT_EQ(index_.FindMerge(merge_id).back().state, +merge_t::UNDONE);
}

TEST_F(LedgerIndexTest, FindsTheNewestModelAndLeaseOfASubmap) {
  TakeSubmap(1, submap_t::ASSIGNED, 1);
  EXPECT_EQ(index_.FindModel(1), nullptr) << "a lease is no model";
  TakeSubmap(1, submap_t::CHECKPOINT, 1);
  const int64_t lease = TakeSubmap(1, submap_t::ASSIGNED, 2);
  const int64_t final = TakeSubmap(1, submap_t::FINAL, 2);
  TakeSubmap(2, submap_t::CHECKPOINT, 1);
  EXPECT_EQ(index_.FindModel(1)->header.seq, final);
  EXPECT_EQ(index_.FindLease(1)->header.seq, lease);
  EXPECT_FALSE(index_.HasEnded(1));
  TakeSubmap(1, submap_t::ENDED, 2);
  EXPECT_TRUE(index_.HasEnded(1));
  EXPECT_FALSE(index_.HasEnded(2));
}

TEST_F(LedgerIndexTest, TheLatestWordOnAPhotoCounts) {
  TakeRegistration(1, 1, 1, registration_t::REGISTERED);
  TakeRegistration(2, 1, 1, registration_t::REGISTERED);
  TakeRegistration(3, 1, 1, registration_t::DEFERRED);
  TakeRegistration(1, 1, 1, registration_t::WITHDRAWN);
  TakeRegistration(1, 2, 1, registration_t::REGISTERED);
  EXPECT_EQ(index_.RegisteredIn(1), std::vector<int64_t>{2});
  EXPECT_EQ(index_.RegisteredIn(2), std::vector<int64_t>{1});
  TakeRegistration(1, 1, 2, registration_t::REGISTERED);
  EXPECT_EQ(index_.RegisteredIn(1), (std::vector<int64_t>{1, 2}));
  EXPECT_EQ(index_.CountRegistrations(1, 1, 1), 2);
  EXPECT_EQ(index_.CountRegistrations(1, 1, 2), 1);
  EXPECT_EQ(index_.CountRegistrations(1, 2, 1), 1);
}

}  // namespace
}  // namespace skein
