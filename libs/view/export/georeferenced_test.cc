#include "export/georeferenced.h"

#include <gtest/gtest.h>

namespace skein::georeferenced_test {

constexpr double kMetresPerDegree = 111'320;  // along the equator

// Photos on a grid of 10 units, looking down; one unit is two metres.
ExportModel GridModel(int num_photos) {
  ExportModel model;
  model.label = "grid of " + std::to_string(num_photos);
  model.reconstruction = std::make_unique<Reconstruction>();
  Camera camera;
  camera.SetCameraId(1);
  camera.InitializeWithName("SIMPLE_RADIAL", 1000, 1200, 900);
  model.reconstruction->AddCamera(camera);
  for (int i = 0; i < num_photos; ++i) {
    Image image;
    image.SetImageId(i + 1);
    image.SetCameraId(1);
    image.SetName("a/" + std::to_string(i));
    image.SetQvec(Eigen::Vector4d(0, 1, 0, 0));
    image.SetTvec(-(image.RotationMatrix() * Eigen::Vector3d(10 * (i % 3), 10 * (i / 3), 5)));
    model.reconstruction->AddImage(image);
    model.reconstruction->RegisterImage(i + 1);
  }
  return model;
}

std::map<std::string, GeodeticPosition> Positions(int num_photos) {
  std::map<std::string, GeodeticPosition> positions;
  for (int i = 0; i < num_photos; ++i) {
    positions["a/" + std::to_string(i)] = {20 * (i / 3) / 110'574.0,
                                           10 + 20 * (i % 3) / kMetresPerDegree, 10};
  }
  return positions;
}

TEST(Georeferenced, ModelIsInMetresEastNorthUp) {
  std::vector<ExportModel> models;
  models.push_back(GridModel(9));
  std::vector<std::string> refusals;
  PlaceOnEarth(Positions(9), &models, &refusals);
  ASSERT_EQ(models.size(), 1u);
  EXPECT_TRUE(refusals.empty());
  const auto& model = *models[0].reconstruction;
  const Eigen::Vector3d origin = model.Image(5).ProjectionCenter();  // the median
  EXPECT_LT(origin.norm(), 0.1);
  EXPECT_LT((model.Image(6).ProjectionCenter() - origin - Eigen::Vector3d(20, 0, 0)).norm(), 0.1);
  EXPECT_LT((model.Image(8).ProjectionCenter() - origin - Eigen::Vector3d(0, 20, 0)).norm(), 0.1);
  // It looked down before, and does so now.
  EXPECT_LT((model.Image(5).RotationMatrix().row(2).transpose() + Eigen::Vector3d::UnitZ()).norm(),
            0.01);
  EXPECT_NEAR(models[0].georeference["enu_from_model"]["scale"], 2, 0.01);
}

TEST(Georeferenced, TakesOutAModelThatCannotBePlacedAndSaysWhy) {
  std::vector<ExportModel> models;
  models.push_back(GridModel(9));
  models.push_back(GridModel(3));
  std::vector<std::string> refusals;
  PlaceOnEarth(Positions(9), &models, &refusals);
  EXPECT_EQ(models.size(), 1u);
  ASSERT_EQ(refusals.size(), 1u);
  EXPECT_EQ(refusals[0], "grid of 3: 3 registered photos carry a position; it takes 5");
}

}  // namespace skein::georeferenced_test
