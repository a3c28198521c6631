#include "web/diagnosis_json.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "testing/test_ledger.h"

namespace skein::diagnosis_json_test {

using nlohmann::json;

json JsonOf(const TestLedger& ledger, int64_t image_id) {
  const PhotoState& photo = *ledger.state().FindPhoto(image_id);
  return DiagnosisJson(ledger.state(), photo, Diagnose(ledger.state(), photo));
}

TEST(DiagnosisJson, TellsTheCauseAndItsFigures) {
  TestLedger ledger;
  ledger.PhotoOf("alice", 1);
  ledger.Describe(1, 0);
  ledger.Matches(1, {});
  ledger.Describe(2, 1);
  ledger.Matches(2, {TestLedger::Pair(1, 17)});
  const json weak = JsonOf(ledger, 2);
  EXPECT_EQ(weak["cause"], "weak overlap");
  EXPECT_EQ(weak["inliers"], 17);
  EXPECT_EQ(weak["needed"], 30);
  EXPECT_EQ(weak["other"], "alice/1.jpg");
  EXPECT_EQ(weak["blur"], 0.2);
  EXPECT_EQ(weak["keypoints"], 5000);
  features_t dark = TestLedger::SharpPhoto();
  dark.brightness = 0.0123F;
  ledger.Describe(3, 1, dark);
  ledger.Matches(3, {});
  EXPECT_EQ(JsonOf(ledger, 3)["cause"], "too dark");
  EXPECT_EQ(JsonOf(ledger, 3)["brightness"], 0.0123);
  EXPECT_EQ(JsonOf(ledger, 3)["other"], "");
}

TEST(DiagnosisJson, ASubmapsReasonGoesWithItsCause) {
  TestLedger ledger;
  for (const int64_t id : {1, 2}) ledger.Describe(id, 1);
  ledger.Matches(1, {});
  ledger.Matches(2, {TestLedger::Pair(1, 200, 0.1F)});
  ledger.Seed(1, 1, 1);
  ledger.Lease(1, 1);
  ledger.Register(1, 1);
  registration_t trial{};
  trial.image_id = 2;
  trial.submap_id = 1;
  trial.state = registration_t::DEFERRED;
  trial.cause = registration_t::CAMERA;
  trial.reason = "camera parameters out of range";
  ledger.Commit(trial);
  EXPECT_EQ(JsonOf(ledger, 2)["cause"], "camera");
  EXPECT_EQ(JsonOf(ledger, 2)["reason"], trial.reason);
}

}  // namespace skein::diagnosis_json_test
