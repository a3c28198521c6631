#include "session/model_place.h"

#include <gtest/gtest.h>

#include "session/report.h"
#include "testing/test_ledger.h"

namespace skein::model_place_test {

// A submap of photos 1 and 2 and a model of this kind that tells this.
class ModelPlaceTest : public testing::Test {
 protected:
  void SetUp() override {
    for (const int64_t id : {1, 2}) ledger_.PhotoOf("alice", id);
    ledger_.Seed(5, 1, 2);
    ledger_.Lease(5, 1);
    model_.submap_id = 5;
    model_.kind = submap_model_t::FINAL;
  }

  const SubmapLife& Submap() const { return *ledger_.state().FindSubmap(5); }
  nlohmann::json Georeference() {
    ledger_.Commit(model_);
    return GeoreferencePart(ledger_.state(), Submap());
  }
  nlohmann::json Completeness() {
    ledger_.Commit(model_);
    return CompletenessPart(Submap());
  }
  // 10 positions, of which that of photo 2 is an outlier.
  void TellGeoreference() {
    georeference_t& told = model_.georeference;
    told.ok = 1;
    told.num_positions = 10;
    told.num_altitudes = 8;
    told.latitude_deg = 48.1;
    told.longitude_deg = 11.5;
    told.scale = 7.5;
    told.rotation_qwxyz[1] = 1;
    told.translation_m[2] = -3;
    told.num_inliers = 9;
    told.rmse_m = 2;
    told.median_m = 1.5;
    told.max_m = 4;
    told.horizontal_rmse_m = 1.75;
    told.rotation_sigma_deg = 0.5;
    told.scale_sigma = 0.01;
    told.num_outliers = 1;
    told.outlier_images = {2};
    told.outlier_residuals_m = {31.5};
  }

  TestLedger ledger_;
  submap_model_t model_{};
};

TEST_F(ModelPlaceTest, ReportTellsTheFiguresOfTheModel) {
  model_.place.num_photos = 12;
  model_.place.num_surfels = 300;
  model_.place.good_share = 0.75F;
  model_.place.verdict = completeness_t::NEARLY;
  model_.place.sentence = "75 % of the surface is good: nearly complete";
  const nlohmann::json part = Completeness();
  EXPECT_EQ(part["photos"], 12);
  EXPECT_EQ(part["surfels"], 300);
  EXPECT_EQ(part["good_share"], 0.75F);
  EXPECT_EQ(part["verdict"], "nearly");
  EXPECT_EQ(part["sentence"], PlaceSentenceOf(Submap()));
  EXPECT_FALSE(part.contains("reason"));
  const nlohmann::json report = MakeReport(ledger_.session(), 0, 1);
  EXPECT_EQ(report["submaps"][0]["completeness"], part);
}

TEST_F(ModelPlaceTest, ReportTellsWhereTheModelLies) {
  TellGeoreference();
  const nlohmann::json part = Georeference();
  EXPECT_EQ(part, nlohmann::json::parse(R"({
    "ok": true, "positions": 10, "altitudes": 8, "inliers": 9, "altitudes_used": false,
    "origin": {"latitude_deg": 48.1, "longitude_deg": 11.5, "altitude_m": null},
    "enu_from_model": {"scale": 7.5, "rotation_wxyz": [0.0, 1.0, 0.0, 0.0],
                       "translation_m": [0.0, 0.0, -3.0]},
    "residual_m": {"rmse": 2.0, "median": 1.5, "max": 4.0, "horizontal_rmse": 1.75,
                   "vertical_rmse": null},
    "rotation_sigma_deg": 0.5, "scale_sigma": 0.01,
    "outliers": [{"image": "alice/2.jpg", "residual_m": 31.5}]})"));
  EXPECT_EQ(MakeReport(ledger_.session(), 0, 1)["submaps"][0]["georeference"], part);
}

TEST_F(ModelPlaceTest, AltitudesAreToldWhereThereAreAny) {
  TellGeoreference();
  model_.georeference.has_altitude = model_.georeference.has_vertical_rmse = 1;
  model_.georeference.altitude_m = 400;
  model_.georeference.vertical_rmse_m = 6;
  const nlohmann::json part = Georeference();
  EXPECT_EQ(part["origin"]["altitude_m"], 400);
  EXPECT_EQ(part["residual_m"]["vertical_rmse"], 6);
}

TEST_F(ModelPlaceTest, APlaceThatCannotBeLocatedHasTheMappersReason) {
  model_.georeference.num_positions = 3;
  model_.georeference.reason = "3 registered photos carry a position; it takes 5";
  EXPECT_EQ(Georeference(), (nlohmann::json{{"ok", false},
                                            {"reason", model_.georeference.reason},
                                            {"positions", 3},
                                            {"altitudes", 0}}));
}

TEST_F(ModelPlaceTest, ModelsWithoutFiguresHaveAReason) {
  EXPECT_EQ(Completeness()["reason"], "the mapper failed at it");
  EXPECT_EQ(Georeference()["reason"], "the mapper failed at it");
  model_.kind = submap_model_t::CHECKPOINT;
  EXPECT_EQ(Completeness()["reason"], "the model is a checkpoint: its mapper did not finish it");
  EXPECT_FALSE(Georeference()["ok"]);
  EXPECT_EQ(PlaceSentenceOf(Submap()), "");
}

TEST_F(ModelPlaceTest, ASentenceDoesNothingToATerminal) {
  model_.place.sentence = "good\n\x1b[2J";
  ledger_.Commit(model_);
  EXPECT_EQ(PlaceSentenceOf(Submap()), "good\\x0a\\x1b[2J");
}

TEST_F(ModelPlaceTest, ASubmapWithoutAModelHasNoSentence) {
  EXPECT_EQ(PlaceSentenceOf(Submap()), "");
}

}  // namespace skein::model_place_test
