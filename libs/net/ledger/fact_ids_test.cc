#include "ledger/fact_ids.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "skein/finish_t.hpp"

namespace skein::fact_ids_test {

TEST(FactIds, NameWhatMustBeInTheLedgerOnce) {
  EXPECT_EQ(ImageFactId("ab"), "image/ab");
  EXPECT_EQ(FeaturesFactId(7), "features/7");
  EXPECT_EQ(CandidatesFactId(7), "candidates/7");
  EXPECT_EQ(MatchesFactId(42), "matches/42");
  EXPECT_EQ(RegistrationFactId(42, 3, 5, 2), "registration/42/3/5/2");
  EXPECT_EQ(SubmapLeaseFactId(3, 5), "submap/3/5/lease");
  EXPECT_EQ(SubmapModelFactId(3, 5, 2), "submap/3/5/model/2");
  EXPECT_EQ(SubmapEndFactId(3), "submap/3/end");
  EXPECT_EQ(MergeAttemptFactId(2, 1, 3, 0, true), "merge/2-1/3/0/ordered");
  EXPECT_EQ(MergeAttemptFactId(2, 1, 3, 9, false), "merge/2-1/3/9/failed");
  EXPECT_EQ(MergeFrozenFactId(50, 2), "merge/50/frozen/2");
  EXPECT_EQ(MergeEndFactId(50, 2), "merge/50/end/2");
  EXPECT_EQ(FailureFactId("features", 4, 1), "failure/features/4/1");
  EXPECT_EQ(FinishRequestFactId(77), "finish/requested/77");
  EXPECT_EQ(FinishFactId(5, finish_t::SETTLED), "finish/5/settled");
  EXPECT_EQ(VanishedAgentFactId("ab", 5), "vanished/ab/5");
}

TEST(FactIds, ASeedIsOneFactWhicheverPhotoComesFirst) {
  EXPECT_EQ(SeedFactId(12, 3), "seed/3-12");
  EXPECT_EQ(SeedFactId(3, 12), "seed/3-12");
}

TEST(FactIds, FactIdsOfAPhotoDiffer) {
  EXPECT_NE(RegistrationFactId(1, 2, 3, 1), RegistrationFactId(1, 2, 3, 2));
  EXPECT_NE(RegistrationFactId(1, 2, 3, 1), RegistrationFactId(1, 2, 4, 1));
  EXPECT_NE(RegistrationFactId(1, 23, 4, 1), RegistrationFactId(12, 3, 4, 1));
}

TEST(FactIds, ARefusedOfferIsItsAgentNameAndContent) {
  EXPECT_EQ(RefusedOfferFactId("a", "b", "c"), RefusedOfferFactId("a", "b", "c"));
  EXPECT_NE(RefusedOfferFactId("a", "bc", "d"), RefusedOfferFactId("ab", "c", "d"));
}

TEST(FactIds, AFinishIsRequestedByACommandAlone) {
  EXPECT_THROW(FinishFactId(5, finish_t::REQUESTED), std::invalid_argument);
}

}  // namespace skein::fact_ids_test
