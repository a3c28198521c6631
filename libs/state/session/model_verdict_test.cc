#include "session/model_verdict.h"

#include <gtest/gtest.h>

#include "testing/test_ledger.h"

namespace skein::model_verdict_test {

// A submap of photos 1 and 2 and a model with this check.
class ModelVerdictTest : public testing::Test {
 protected:
  void SetUp() override {
    for (const int64_t id : {1, 2}) ledger_.PhotoOf("alice", id);
    ledger_.Seed(5, 1, 2);
    ledger_.Lease(5, 1);
  }

  const SubmapLife& WithCheck(const model_check_t& check) {
    submap_model_t model{};
    model.submap_id = 5;
    model.check = check;
    ledger_.Commit(model);
    return *ledger_.state().FindSubmap(5);
  }

  TestLedger ledger_;
  model_check_t check_{};
};

TEST_F(ModelVerdictTest, OfASubmapThatWasNotCheckedThereIsNothingToTell) {
  EXPECT_EQ(VerdictOf(ledger_.state(), *ledger_.state().FindSubmap(5)), "");
  EXPECT_TRUE(CheckPart(ledger_.state(), WithCheck(check_)).is_null());
}

TEST_F(ModelVerdictTest, BelowTheThresholdOnlyFiguresAreTold) {
  check_.position_sigma = 0.009;
  check_.loose_image = 2;
  check_.anchor_image = 1;
  check_.num_matches = 7;
  const nlohmann::json part = CheckPart(ledger_.state(), WithCheck(check_));
  EXPECT_EQ(part["verdict"], "");
  EXPECT_DOUBLE_EQ(part["expected_position_error_percent"], 0.9);
  EXPECT_EQ(part["weakest_link"], nlohmann::json({"alice/2.jpg", "alice/1.jpg"}));
  EXPECT_EQ(part["matches"], 7);
  EXPECT_FALSE(part.contains("most_contradicting_pair"));
}

TEST_F(ModelVerdictTest, AboveItTheWeakestLinkIsNamed) {
  check_.position_sigma = 0.0191;
  check_.loose_image = 2;
  check_.anchor_image = 1;
  check_.num_loose_images = 12;
  EXPECT_EQ(VerdictOf(ledger_.state(), WithCheck(check_)),
            "may be bent: expected position error 1.9 % of the extent, 12 photos hang on the rest "
            "by alice/2.jpg - alice/1.jpg");
}

TEST_F(ModelVerdictTest, APartThatHangsByFewPointsIsNamed) {
  check_.position_sigma = 1;
  check_.loose_image = 2;
  check_.anchor_image = 1;
  check_.num_loose_images = 3;
  EXPECT_EQ(VerdictOf(ledger_.state(), WithCheck(check_)),
            "a part may stand in a wrong place: 3 photos share hardly any points with the rest, on "
            "which they hang by alice/2.jpg - alice/1.jpg");
}

TEST_F(ModelVerdictTest, FewContradictingMatchesAreOnlyInTheFigures) {
  check_.position_sigma = 0.001;
  check_.num_matches = 26500;
  check_.num_contradicting_matches = 200;
  const nlohmann::json part = CheckPart(ledger_.state(), WithCheck(check_));
  EXPECT_EQ(part["verdict"], "");
  EXPECT_EQ(part["contradicting_matches"], 200);
}

TEST_F(ModelVerdictTest, ManyContradictingMatchesAreTold) {
  check_.position_sigma = 0.001;
  check_.num_matches = 22000;
  check_.num_contradicting_matches = 1400;
  check_.contradicting_image1 = 1;
  check_.contradicting_image2 = 2;
  check_.num_contradicting_of_pair = 83;
  EXPECT_EQ(VerdictOf(ledger_.state(), WithCheck(check_)),
            "contradicted: 6 % of the verified matches disagree with the poses, most of all 83 of "
            "alice/1.jpg - alice/2.jpg");
}

}  // namespace skein::model_verdict_test
