#include "geometry/model_georeference.h"

#include <gtest/gtest.h>

namespace skein::model_georeference_test {

// Photos 3, 1 and 2, registered in this order, and 4, which is not. Photo i stands at (i, 0, 0).
Reconstruction FourPhotos() {
  Reconstruction model;
  Camera camera;
  camera.SetCameraId(1);
  camera.InitializeWithName("SIMPLE_RADIAL", 1000, 1200, 900);
  model.AddCamera(camera);
  for (const ImageId id : {3, 1, 2, 4}) {
    Image image;
    image.SetImageId(id);
    image.SetCameraId(1);
    image.SetName("a/" + std::to_string(id));
    image.SetQvec(Eigen::Vector4d(1, 0, 0, 0));
    image.SetTvec(Eigen::Vector3d(-static_cast<double>(id), 0, 0));
    model.AddImage(image);
    if (id != 4) model.RegisterImage(id);
  }
  return model;
}

TEST(ModelGeoreference, PhotosThatAreRegisteredAndCarryAPositionComeInOrder) {
  const GeodeticPosition place{48, 11, {}};
  const PhotoPositions positions = {{"a/1", place}, {"a/3", place}, {"a/4", place}, {"b/2", place}};
  const std::vector<GeoPhoto> photos = PhotosWithPosition(FourPhotos(), positions);
  ASSERT_EQ(photos.size(), 2u);
  EXPECT_EQ(photos[0].name, "a/1");
  EXPECT_EQ(photos[1].name, "a/3");
  EXPECT_EQ(photos[1].cam_from_world.Centre(), Eigen::Vector3d(3, 0, 0));
  EXPECT_EQ(photos[1].position.latitude_deg, 48);
}

TEST(ModelGeoreference, TheOriginIsThatOfAllPositions) {
  const PhotoPositions positions = {
      {"a/1", {48, 11, 500}}, {"a/2", {48.1, 11, 510}}, {"b/1", {48.2, 11, 520}}};
  EXPECT_EQ(OriginOfPhotos(positions).latitude_deg, 48.1);
  EXPECT_EQ(OriginOfPhotos(positions).altitude_m, 510.0);
  EXPECT_EQ(OriginOfPhotos({}).latitude_deg, 0);
}

}  // namespace skein::model_georeference_test
