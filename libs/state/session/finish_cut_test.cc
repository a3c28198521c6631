#include "session/finish_cut.h"

#include <gtest/gtest.h>

#include "session/diagnosis.h"
#include "session/report.h"
#include "testing/test_ledger.h"

namespace skein::finish_cut_test {

// Photos 1 to 4 are matched, of which 4 was never tried; 5 is in work. Submap 1 has 1 to 3.
class FinishCutTest : public testing::Test {
 protected:
  FinishCutTest() {
    for (const int64_t id : {1, 2, 3, 4}) {
      ledger_.Matches(id, id == 1 ? std::vector<two_view_t>{} : std::vector{TestLedger::Pair(1)});
    }
    ledger_.Photo(5);
    ledger_.Seed(1, 1, 2);
    ledger_.Lease(1, 1);
    for (const int64_t id : {1, 2, 3}) ledger_.Register(1, id);
  }
  const SessionState& state() const { return ledger_.state(); }
  const FinishState& finish() const { return state().finish(); }
  // Up to SETTLED, cut in the state `at`.
  void CutAt(int8_t at) {
    for (const int8_t step : {finish_t::REQUESTED, finish_t::DRAINED, finish_t::SETTLED}) {
      ledger_.Finish(step, 9);
      if (step == at) ledger_.Finish(finish_t::CUT);
    }
  }
  void WriteFinalModel() { ledger_.Model(1, submap_model_t::FINAL, ledger_.head(), 3); }
  std::string LeftOut() const {
    const FinishCut cut = FindCut(state());
    return cut.submaps.empty() ? "" : cut.submaps[0].left_out;
  }

  TestLedger ledger_;
};

TEST_F(FinishCutTest, AFinishWithoutADeadlineIsNotCut) {
  ledger_.Finish(finish_t::REQUESTED);
  EXPECT_EQ(finish().deadline_utime_us, 0);
  EXPECT_FALSE(finish().is_cut());
  EXPECT_FALSE(MakeReport(ledger_.session(), 0, 1).contains("cut"));
}

TEST_F(FinishCutTest, ALaterDeadlineFactReplacesTheDeadlineAndKeepsTheStage) {
  ledger_.Finish(finish_t::REQUESTED, 500);
  ledger_.Finish(finish_t::DRAINED);
  ledger_.Finish(finish_t::DEADLINE, 300);
  EXPECT_EQ(finish().deadline_utime_us, 300);
  EXPECT_EQ(finish().state, +finish_t::DRAINED);
}

TEST_F(FinishCutTest, IsCutFromTheCutUntilDone) {
  CutAt(finish_t::REQUESTED);
  EXPECT_TRUE(finish().is_cut());
  EXPECT_EQ(finish().state, +finish_t::SETTLED);
  ledger_.Finish(finish_t::DONE);
  EXPECT_FALSE(finish().is_cut());
  ledger_.Finish(finish_t::REQUESTED);
  EXPECT_FALSE(finish().is_cut()) << "another one";
}

TEST_F(FinishCutTest, NamesPhotosThatWereInWorkThoughTheyAreMatchedSoonAfter) {
  CutAt(finish_t::REQUESTED);
  ledger_.Matches(5, {TestLedger::Pair(1)});
  const FinishCut cut = FindCut(state());
  EXPECT_EQ(cut.during, "matching");
  EXPECT_EQ(cut.not_matched, std::vector<int64_t>{5});
  EXPECT_EQ(cut.not_tried, std::vector<int64_t>{4});
}

TEST_F(FinishCutTest, TellsOfEachSubmapWhatItLacks) {
  CutAt(finish_t::DRAINED);
  EXPECT_EQ(LeftOut(), "no model yet");
  ledger_.Model(1, submap_model_t::CHECKPOINT, 0, 2);
  EXPECT_EQ(LeftOut(), "its mapper did not answer in time: an earlier model, 2 of 3 photos");
  WriteFinalModel();
  EXPECT_EQ(LeftOut(), "consolidation and final adjustment not completed");
}

TEST_F(FinishCutTest, ASubmapThatWasReadyInTimeLacksNothing) {
  ledger_.Finish(finish_t::REQUESTED, 9);
  ledger_.Finish(finish_t::DRAINED);
  ledger_.Finish(finish_t::SETTLED);
  WriteFinalModel();
  ledger_.Finish(finish_t::CUT);
  EXPECT_EQ(LeftOut(), "");
  EXPECT_EQ(FindCut(state()).during, "final adjustment");
}

TEST_F(FinishCutTest, TheReportAndTheSummaryNameWhatWasLeftOut) {
  CutAt(finish_t::REQUESTED);
  WriteFinalModel();
  const auto cut = MakeReport(ledger_.session(), 0, 1).at("cut");
  EXPECT_EQ(cut["not_matched"].size(), 1u);
  EXPECT_EQ(cut["submaps"][0]["id"], 1);
  const std::string summary = CutSummary(state(), FindCut(state()));
  EXPECT_NE(summary.find("during matching; 1 photo not matched in time ("), std::string::npos);
  EXPECT_NE(summary.find("; map 1: consolidation and"), std::string::npos);
}

TEST_F(FinishCutTest, APhotoThatNoSubmapSpokeOfWasNotTriedInTime) {
  ledger_.Describe(4, 1);
  const auto cause = [&] { return Diagnose(state(), *state().FindPhoto(4)).cause; };
  EXPECT_NE(cause(), Diagnosis::Cause::kNotInTime);
  CutAt(finish_t::DRAINED);
  EXPECT_EQ(cause(), Diagnosis::Cause::kNotInTime);
}

}  // namespace skein::finish_cut_test
