#include "ingest/work_planner.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "testing/test_ledger.h"

namespace skein::work_planner_test {

class WorkPlannerTest : public testing::Test {
 protected:
  template <class T>
  void Commit(T fact) {
    ledger_.Commit(fact);
    planner_.OnFact(fact, 0);
  }
  void Describe(int64_t image_id) {
    image_t image{};
    image.image_id = image_id;
    Commit(image);
    features_t features{};
    features.image_id = image_id;
    Commit(features);
    candidates_t candidates{};
    candidates.image_id = image_id;
    Commit(candidates);
  }
  void Match(int64_t image_id, int8_t part) {
    matches_t matches{};
    matches.image_id = image_id;
    matches.part = part;
    Commit(matches);
  }
  // What the worker is granted of matching, when it can take so much.
  std::vector<int64_t> Grants(int capacity, const std::vector<int64_t>& held = {}) {
    return GrantsOf(&planner_, capacity, held);
  }
  std::vector<int64_t> GrantsOf(WorkPlanner* planner, int capacity,
                                const std::vector<int64_t>& held = {}) {
    now_s_ += 10;
    planner->OnRequest("matching", {"w", capacity, 0, held}, now_s_);
    std::vector<int64_t> items;
    for (const auto& grant : planner->Assign(now_s_)) {
      if (grant.kind == "matching") items.push_back(grant.item);
    }
    return items;
  }

  double now_s_ = 0;
  TestLedger ledger_;
  WorkPlanner planner_{ledger_.session(), kLeaseS, 0};
};

using Ids = std::vector<int64_t>;

TEST_F(WorkPlannerTest, TheNewestPhotoComesFirstAndTheOldestRestOnceNoneWaits) {
  for (const int64_t id : {1, 2, 3, 4}) Describe(id);
  EXPECT_EQ(Grants(1), Ids{4});
  Match(4, matches_t::FIRST);
  EXPECT_EQ(Grants(1), Ids{3});
  Match(3, matches_t::FIRST);
  EXPECT_EQ(Grants(2), (Ids{2, 1}));
  Match(2, matches_t::ALL);
  Match(1, matches_t::ALL);
  EXPECT_EQ(Grants(2), Ids{-3}) << "one at a time";
  Match(3, matches_t::REST);
  EXPECT_EQ(Grants(2), Ids{-4});
  Match(4, matches_t::REST);
  EXPECT_TRUE(Grants(2).empty());
}

TEST_F(WorkPlannerTest, ARestWaitsWhileAPhotoWaitsForItsFeatures) {
  Describe(1);
  Match(1, matches_t::FIRST);
  image_t image{};
  image.image_id = 2;
  Commit(image);
  EXPECT_TRUE(Grants(2).empty());
  features_t features{};
  features.image_id = 2;
  Commit(features);
  EXPECT_EQ(Grants(2), Ids{-1});
}

TEST_F(WorkPlannerTest, ARestartKnowsTheRestsThatAreDueAndTheirFailures) {
  Describe(1);
  Match(1, matches_t::FIRST);
  failure_t failure{};
  failure.image_id = 1;
  failure.stage = "rest";
  failure.attempts = 2;
  Commit(failure);
  WorkPlanner next(ledger_.session(), kLeaseS, 0);
  EXPECT_EQ(GrantsOf(&next, 1), Ids{-1});
  const auto failures = next.OnFailed("matching", "w", -1, "again", false, now_s_);
  ASSERT_EQ(failures.size(), 1u);
  EXPECT_EQ(failures[0].stage, "rest");
  EXPECT_EQ(failures[0].failure.item, 1);
  EXPECT_EQ(failures[0].failure.attempts, 3);
  EXPECT_TRUE(failures[0].failure.parked);
  failure.attempts = 3;
  failure.parked = true;
  Commit(failure);
  EXPECT_TRUE(Grants(1).empty());
}

TEST_F(WorkPlannerTest, AWorkerGoesOnWithTheRestThatItHeldBeforeARestart) {
  Describe(1);
  Match(1, matches_t::FIRST);
  WorkPlanner next(ledger_.session(), kLeaseS, 0);
  EXPECT_TRUE(GrantsOf(&next, 2, {-1}).empty());
  EXPECT_EQ(next.NumWaiting("matching"), 0u);
}

}  // namespace skein::work_planner_test
