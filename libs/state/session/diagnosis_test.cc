#include "session/diagnosis.h"

#include <gtest/gtest.h>

#include "testing/test_ledger.h"

namespace skein::diagnosis_test {

using Cause = Diagnosis::Cause;

// Photo 1 is in submap 1; photo 2 is the one in question.
class DiagnosisTest : public testing::Test {
 protected:
  DiagnosisTest() {
    ledger_.Describe(1, 0);
    ledger_.Matches(1, {});
    ledger_.Seed(1, 1, 1);
    ledger_.Lease(1, 1);
    ledger_.Register(1, 1);
  }
  static features_t Photo(void (*change)(features_t*)) {
    features_t features = TestLedger::SharpPhoto();
    change(&features);
    return features;
  }
  static two_view_t Pair(int num_inliers, int8_t geometry, float tri_angle_rad) {
    two_view_t pair = TestLedger::Pair(1, num_inliers, tri_angle_rad);
    pair.geometry = geometry;
    return pair;
  }
  void Try(int8_t cause, const std::string& reason) {
    registration_t trial{};
    trial.image_id = 2;
    trial.submap_id = 1;
    trial.state = registration_t::DEFERRED;
    trial.cause = cause;
    trial.reason = reason;
    ledger_.Commit(trial);
  }
  // A ledger of photos 2 and 3, which `pair` links. None is in a map.
  static void LinkTwo(two_view_t pair, TestLedger* ledger) {
    for (const int64_t id : {2, 3}) ledger->Describe(id, 1);
    ledger->Matches(2, {});
    pair.other_id = 2;
    ledger->Matches(3, {pair});
  }
  static Diagnosis OfThree(const TestLedger& ledger) {
    return Diagnose(ledger.state(), *ledger.state().FindPhoto(3));
  }
  Diagnosis Get() const { return Diagnose(ledger_.state(), *ledger_.state().FindPhoto(2)); }
  Cause OfPhoto(void (*change)(features_t*)) {
    TestLedger ledger;
    ledger.Describe(2, 1, Photo(change));
    ledger.Matches(2, {});
    return Diagnose(ledger.state(), *ledger.state().FindPhoto(2)).cause;
  }

  TestLedger ledger_;
  static constexpr int8_t kCalibrated = 2, kPlanar = 4, kPanoramic = 5;
};

TEST_F(DiagnosisTest, APhotoInWorkWaits) {
  ledger_.Photo(2);
  EXPECT_EQ(Get().cause, Cause::kWaiting);
  EXPECT_EQ(Get().remedy, "");
  ledger_.Describe(2, 1);
  EXPECT_EQ(Get().what, "waits for its matches");
}

TEST_F(DiagnosisTest, TheFirstPhotoWaitsForOthers) {
  ledger_.Describe(2, 0);
  ledger_.Matches(2, {});
  EXPECT_EQ(Get().cause, Cause::kWaiting);
}

TEST_F(DiagnosisTest, TheFaultOfAPhotoIsToldBeforeItsOverlap) {
  EXPECT_EQ(OfPhoto([](features_t* f) { f->brightness = 0.01F; }), Cause::kTooDark);
  EXPECT_EQ(OfPhoto([](features_t* f) { f->brightness = 0.99F; }), Cause::kTooBright);
  EXPECT_EQ(OfPhoto([](features_t* f) { f->blur = 0.6F; }), Cause::kBlurred);
  EXPECT_EQ(OfPhoto([](features_t* f) { f->num_keypoints = 20; }), Cause::kBare);
  EXPECT_EQ(OfPhoto([](features_t* f) { f->coverage = 0.2F; }), Cause::kBare);
  EXPECT_EQ(OfPhoto([](features_t*) {}), Cause::kNoOverlap);
}

TEST_F(DiagnosisTest, APhotoWithAStrongPairIsSharpEnough) {
  ledger_.Describe(2, 1, Photo([](features_t* f) { f->blur = 0.6F; }));
  ledger_.Matches(2, {Pair(90, kCalibrated, 0.1F)});
  EXPECT_EQ(Get().cause, Cause::kBlurred);
  TestLedger strong;
  strong.Describe(2, 1, Photo([](features_t* f) { f->blur = 0.6F; }));
  strong.Matches(2, {Pair(1000, kCalibrated, 0.1F)});
  EXPECT_EQ(Diagnose(strong.state(), *strong.state().FindPhoto(2)).cause, Cause::kWaiting);
}

TEST_F(DiagnosisTest, AWeakOverlapTellsHowMuchIsLackingAndWhere) {
  ledger_.Describe(2, 1);
  ledger_.Matches(2, {Pair(17, kCalibrated, 0.1F)});
  EXPECT_EQ(Get().cause, Cause::kWeakOverlap);
  EXPECT_EQ(Get().what.find("17 of 30 inliers with "), 0u) << Get().what;
  EXPECT_EQ(Get().num_inliers, 17);
  EXPECT_EQ(Get().best_other_id, 1);
}

TEST_F(DiagnosisTest, PairsThatNoMapCanBeginWith) {
  const auto of_three_with = [](const two_view_t& pair) {
    TestLedger ledger;
    LinkTwo(pair, &ledger);
    return OfThree(ledger).cause;
  };
  EXPECT_EQ(of_three_with(Pair(400, kPanoramic, 0)), Cause::kRotationOnly);
  EXPECT_EQ(of_three_with(Pair(60, kPlanar, 0.1F)), Cause::kPlanarOnly);
  EXPECT_EQ(of_three_with(Pair(400, kPlanar, 0.1F)), Cause::kWaiting) << "one can begin";
  EXPECT_EQ(of_three_with(Pair(400, kPlanar, 0)), Cause::kRotationOnly);
  EXPECT_EQ(of_three_with(Pair(400, kCalibrated, 0.1F)), Cause::kWaiting) << "one can begin";
  EXPECT_EQ(of_three_with(Pair(60, kCalibrated, 0.1F)), Cause::kWeakOverlap);
}

// A turntable's background may look like a rotation (matching/overlay.h).
TEST_F(DiagnosisTest, OfOneSpotTheRemedyHelpsBeforeATurntableToo) {
  TestLedger ledger;
  LinkTwo(Pair(400, kPanoramic, 0), &ledger);
  const std::string remedy = OfThree(ledger).remedy;
  EXPECT_EQ(remedy.find("take a step sideways"), 0u) << remedy;
  EXPECT_NE(remedy.find("cover what stands still"), std::string::npos) << remedy;
}

TEST_F(DiagnosisTest, AWeakPairDoesNotHideThatAllIsOfOneSpot) {
  TestLedger ledger;
  for (const int64_t id : {2, 3, 4}) ledger.Describe(id, 1);
  const auto pair = [](int64_t other, int inliers, int8_t geometry, float angle) {
    two_view_t view = Pair(inliers, geometry, angle);
    view.other_id = other;
    return view;
  };
  ledger.Matches(2, {});
  ledger.Matches(3, {pair(2, 600, kPanoramic, 0)});
  ledger.Matches(4, {pair(3, 700, kPanoramic, 0), pair(2, 200, kCalibrated, 0.1F)});
  for (const int64_t id : {2, 3, 4}) {
    EXPECT_EQ(Diagnose(ledger.state(), *ledger.state().FindPhoto(id)).cause, Cause::kRotationOnly)
        << id;
  }
}

// Who stands at the site is not sent back for a photo that its map will take in a moment.
TEST_F(DiagnosisTest, APhotoThatNobodyTriedYetWaits) {
  ledger_.Describe(2, 1);
  ledger_.Matches(2, {Pair(200, kCalibrated, 0.1F)});
  EXPECT_EQ(Get().cause, Cause::kWaiting);
  EXPECT_EQ(Get().remedy, "");
  finish_t settled{};
  settled.state = finish_t::REQUESTED;
  ledger_.Commit(settled);
  settled.state = finish_t::SETTLED;
  ledger_.Commit(settled);
  EXPECT_EQ(Get().cause, Cause::kWeakOverlap) << "the finish left it out";
}

TEST_F(DiagnosisTest, AStrongPairThatBeganNoMapIsNoWeakOverlap) {
  TestLedger ledger;
  LinkTwo(Pair(400, kCalibrated, 0.1F), &ledger);
  ledger.Finish(finish_t::REQUESTED);
  ledger.Finish(finish_t::SETTLED);
  const Diagnosis told = OfThree(ledger);
  EXPECT_EQ(told.cause, Cause::kNoInitialPair);
  EXPECT_NE(told.what.find("which share 400 points"), std::string::npos) << told.what;
}

// The map knows the depth of what it sees from the same spot.
TEST_F(DiagnosisTest, APairWithTheMapIsNotRotationOnly) {
  ledger_.Describe(2, 1);
  ledger_.Matches(2, {Pair(400, kPanoramic, 0)});
  EXPECT_NE(Get().cause, Cause::kRotationOnly);
}

TEST_F(DiagnosisTest, APhotoWithoutFeaturesIsComparedWithNothingAndDoesNotWait) {
  features_t black{};
  black.image_id = 2;
  ledger_.Photo(2);
  ledger_.Commit(black);
  EXPECT_EQ(Get().cause, Cause::kTooDark);
}

TEST_F(DiagnosisTest, WhatTheMapSaysOfItComesWithItsReason) {
  ledger_.Describe(2, 1);
  ledger_.Matches(2, {Pair(200, kCalibrated, 0.1F)});
  Try(registration_t::SIMILAR_PLACE, "of another, visually similar place");
  EXPECT_EQ(Get().cause, Cause::kSimilarPlace);
  EXPECT_EQ(Get().what, "of another, visually similar place");
  Try(registration_t::CONTRADICTED, "its matches disagree");
  EXPECT_EQ(Get().cause, Cause::kContradicted);
  Try(registration_t::CAMERA, "camera parameters out of range");
  EXPECT_EQ(Get().cause, Cause::kCamera);
  Try(registration_t::FEW_COMMON_POINTS, "too few visible points");
  EXPECT_EQ(Get().cause, Cause::kWeakOverlap);
  EXPECT_EQ(Get().what.find("too few visible points; best link: 200 inliers"), 0u) << Get().what;
}

TEST_F(DiagnosisTest, WhatAStageSaysOfItStands) {
  failure_t failure{};
  failure.image_id = 2;
  failure.stage = "features";
  failure.reason = "cannot decode";
  failure.parked = true;
  ledger_.Photo(2);
  ledger_.Commit(failure);
  EXPECT_EQ(Get().cause, Cause::kFailed);
  EXPECT_EQ(Get().what, "cannot decode");
  EXPECT_EQ(Get().reason, "cannot decode");
}

TEST_F(DiagnosisTest, WhatASubmapSaysHasTheNameOfItsDiagnosis) {
  ledger_.Describe(2, 1);
  ledger_.Matches(2, {Pair(200, kCalibrated, 0.1F)});
  for (const int8_t cause : {registration_t::FEW_COMMON_POINTS, registration_t::SIMILAR_PLACE,
                             registration_t::CONTRADICTED, registration_t::CAMERA}) {
    Try(cause, "reason");
    EXPECT_STREQ(TrialCauseName(cause), CauseName(Get().cause));
    EXPECT_EQ(Get().reason, "reason");
  }
  EXPECT_STREQ(TrialCauseName(registration_t::OTHER), "other");
}

// A message's constants are this enum's.
TEST_F(DiagnosisTest, EachCauseHasAName) {
  for (int cause = 0; cause <= static_cast<int>(Cause::kNotInTime); ++cause) {
    EXPECT_STRNE(CauseName(static_cast<Cause>(cause)), "") << cause;
  }
  EXPECT_STRNE(CauseName(Cause::kNoInitialPair), "");
  EXPECT_EQ(static_cast<int>(Cause::kNoInitialPair), +photo_diagnosis_t::NO_INITIAL_PAIR);
}

}  // namespace skein::diagnosis_test
