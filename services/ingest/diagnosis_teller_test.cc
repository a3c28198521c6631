#include "ingest/diagnosis_teller.h"

#include <gtest/gtest.h>

#include <vector>

#include "testing/test_ledger.h"

namespace skein::diagnosis_teller_test {

class DiagnosisTellerTest : public testing::Test {
 protected:
  DiagnosisTellerTest()
      : teller_(ledger_.state(), "abc",
                [this](const photo_diagnosis_t& message) { told_.push_back(message); }) {}
  void AddUnplaced(int64_t id) {
    ledger_.Describe(id, 1);
    ledger_.Matches(id, {});
  }
  void Place(int64_t id) {
    ledger_.Seed(1, id, id);
    ledger_.Lease(1, 1);
    ledger_.Register(1, id);
  }
  std::vector<photo_diagnosis_t> At(double now_s) {
    told_.clear();
    teller_.Tick(now_s);
    return told_;
  }

  TestLedger ledger_;
  std::vector<photo_diagnosis_t> told_;
  DiagnosisTeller teller_;
};

TEST_F(DiagnosisTellerTest, TellsAtOnceAndAgain) {
  AddUnplaced(1);
  ASSERT_EQ(At(0).size(), 1u);
  EXPECT_EQ(told_[0].cause, +photo_diagnosis_t::NO_OVERLAP);
  EXPECT_EQ(told_[0].session_id, "abc");
  EXPECT_NE(told_[0].remedy, "");
  EXPECT_TRUE(At(5).empty());
  EXPECT_EQ(At(10).size(), 1u);
}

TEST_F(DiagnosisTellerTest, TellsAChangeAtOnce) {
  AddUnplaced(1);
  ledger_.Describe(2, 1);
  At(0);
  ledger_.Matches(2, {TestLedger::Pair(1, 17)});
  ASSERT_EQ(At(1).size(), 2u);
  EXPECT_EQ(told_[1].cause, +photo_diagnosis_t::WEAK_OVERLAP);
}

TEST_F(DiagnosisTellerTest, WhatIsPlacedAfterAllIsToldThreeTimes) {
  AddUnplaced(1);
  At(0);
  Place(1);
  ASSERT_EQ(At(1).size(), 1u);
  EXPECT_EQ(told_[0].cause, +photo_diagnosis_t::PLACED);
  EXPECT_TRUE(At(2).empty());
  EXPECT_EQ(At(11).size(), 1u);
  EXPECT_EQ(At(21).size(), 1u);
  EXPECT_TRUE(At(31).empty());
}

TEST_F(DiagnosisTellerTest, APhotoThatIsPlacedOrWaitsIsNotSpokenOf) {
  AddUnplaced(1);
  Place(1);
  ledger_.Photo(2);
  EXPECT_TRUE(At(0).empty());
}

TEST_F(DiagnosisTellerTest, ManyAreToldOneAfterTheOther) {
  for (int64_t id = 1; id <= 120; ++id) AddUnplaced(id);
  EXPECT_EQ(At(0).size(), 50u);
  EXPECT_EQ(At(1).size(), 50u);
  EXPECT_EQ(At(2).size(), 20u);
}

}  // namespace skein::diagnosis_teller_test
