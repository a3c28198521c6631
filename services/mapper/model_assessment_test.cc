#include "mapper/model_assessment.h"

#include <gtest/gtest.h>

#include "testing/synthetic_scene.h"

namespace skein::model_assessment_test {

constexpr double kMetresPerUnit = 3;
constexpr double kMetresPerDegreeEast = 111'320, kMetresPerDegreeNorth = 110'574;  // on the equator

// A wall with twelve photos, whose ids are 1 to 12.
class ModelAssessmentTest : public testing::Test {
 protected:
  static SyntheticOptions Options() {
    SyntheticOptions options;
    options.shape = SyntheticOptions::Shape::kWall;
    options.num_photos = 12;
    options.num_points = 4000;
    return options;
  }
  ModelAssessmentTest() { FillMap(scene_, &map_); }

  ModelAssessment Assess(double target_gsd_mm = 0) const {
    return AssessModel(map_.reconstruction(), photos_, target_gsd_mm);
  }
  // On the equator. The model's x is east, z is north, y is down.
  void AddPositions() {
    for (size_t i = 0; i < scene_.photos.size(); ++i) {
      const Eigen::Vector3d metres = kMetresPerUnit * scene_.Center(i);
      photos_.positions[scene_.photos[i].name] = {metres.z() / kMetresPerDegreeNorth,
                                                  11 + metres.x() / kMetresPerDegreeEast,
                                                  500 - metres.y()};
    }
  }

  const SyntheticScene scene_ = MakeScene(Options());
  SceneMap map_;
  PhotoFacts photos_;
};

TEST_F(ModelAssessmentTest, TellsHowCompleteThePlaceIs) {
  const ModelAssessment assessment = Assess();
  EXPECT_EQ(assessment.place.num_photos, 12u);
  EXPECT_GT(assessment.place.num_surfels, 20u);
  EXPECT_GT(assessment.place.completeness.area, 0);
  EXPECT_GT(assessment.place.completeness.good_share, 0);
  EXPECT_NE(assessment.place.sentence.find("of the surface is good"), std::string::npos);
  EXPECT_EQ(assessment.metres_per_unit, 0);
  EXPECT_FALSE(assessment.georeference.ok);
  EXPECT_NE(assessment.georeference.reason, "");
  EXPECT_EQ(assessment.image_of.at(scene_.photos[4].name), 5);
}

TEST_F(ModelAssessmentTest, APlaceWhosePhotosShowNoTextureIsNotGood) {
  for (int64_t id = 1; id <= 12; ++id) photos_.textures[id] = TextureFields();
  EXPECT_EQ(Assess().place.completeness.good_share, 0);
}

TEST_F(ModelAssessmentTest, AModelWithoutPointsIsAssessedAllTheSame) {
  const ModelAssessment assessment = AssessModel(Reconstruction(), photos_, 0);
  EXPECT_EQ(assessment.place.num_photos, 0u);
  EXPECT_EQ(assessment.place.verdict, PlaceVerdict::kGrowing);
}

TEST_F(ModelAssessmentTest, GpsGivesTheScaleAndTheTarget) {
  AddPositions();
  const ModelAssessment assessment = Assess(30);
  ASSERT_TRUE(assessment.georeference.ok) << assessment.georeference.reason;
  EXPECT_EQ(assessment.georeference.num_positions, 12u);
  EXPECT_NEAR(assessment.georeference.enu_from_model.scale, kMetresPerUnit, 0.03);
  EXPECT_EQ(assessment.metres_per_unit, assessment.georeference.enu_from_model.scale);
  EXPECT_NEAR(assessment.place.completeness.target_gsd, 0.01, 1e-4);
  photos_.positions.clear();
  EXPECT_NE(Assess(30).place.completeness.target_gsd, 0.01) << "the scale is not known";
}

TEST_F(ModelAssessmentTest, TheOriginIsThatOfAllPhotosOfTheSession) {
  AddPositions();
  const GeodeticPosition elsewhere{1, 12, 100};
  for (int i = 0; i < 30; ++i) photos_.positions["bob/" + std::to_string(i)] = elsewhere;
  const ModelAssessment assessment = Assess();
  EXPECT_EQ(assessment.georeference.origin.latitude_deg, 1);
  EXPECT_EQ(assessment.georeference.origin.altitude_m, 100.0);
  EXPECT_EQ(assessment.georeference.num_positions, 12u);
}

}  // namespace skein::model_assessment_test
