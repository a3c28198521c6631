// Cameras whose intrinsics are given: fixed ones stay, others are refined from there on.
#include <gtest/gtest.h>

#include "mapping/submap.h"
#include "testing/synthetic_scene.h"

namespace skein::known_camera_test {

const std::vector<double> kGiven = {1012, 640, 480, 0.01};  // of a true focal length of 1000 px

class KnownCamera : public testing::Test {
 protected:
  KnownCamera() {
    options_.num_photos = 10;
    options_.prior_factor = 1.3;
    options_.focal_from_exif = false;
    scene_ = MakeScene(options_);
  }

  void Give(bool fixed) {
    for (PhotoInput& photo : scene_.photos) {
      photo.camera_model = "SIMPLE_RADIAL";
      photo.camera_params = {kGiven[0], photo.width_px / 2.0, photo.height_px / 2.0, kGiven[3]};
      photo.camera_fixed = fixed;
    }
  }

  void Map(Submap* submap) {
    const Submap::EventSink ignore = [](const PhotoEvent&) {};
    for (size_t i = 0; i < scene_.photos.size(); ++i) {
      ASSERT_TRUE(submap->AddPhoto(scene_.photos[i]).ok());
      ASSERT_TRUE(submap->AddPairs(scene_.photos[i].image_id, scene_.pairs[i]).ok());
    }
    InitialPairOptions initial;
    initial.min_triangulation_angle_deg = 8;
    ASSERT_TRUE(submap->Start(initial, 1, 3, ignore).status.ok());
    for (const PhotoInput& photo : scene_.photos) submap->Enqueue(photo.image_id);
    while (submap->Step(ignore)) continue;
    submap->Finish(ignore);
    ASSERT_EQ(submap->Statistics().num_images, options_.num_photos);
  }

  static std::vector<double> Params(const Submap& submap) {
    return submap.map().reconstruction().Camera(1).Params();
  }

  SyntheticOptions options_;
  SyntheticScene scene_;
};

TEST_F(KnownCamera, FixedStaysExactly) {
  Give(true);
  Submap submap{SubmapOptions()};
  Map(&submap);
  EXPECT_EQ(Params(submap), scene_.photos[0].camera_params);
  EXPECT_EQ(submap.map().FixedCameras(), std::set<CameraId>{1});
}

TEST_F(KnownCamera, RefinedStartsThere) {
  Give(false);
  Submap submap{SubmapOptions()};
  ASSERT_TRUE(submap.AddPhoto(scene_.photos[0]).ok());
  EXPECT_EQ(Params(submap), scene_.photos[0].camera_params);
  EXPECT_EQ(submap.map().camera_state(1).prior_params, scene_.photos[0].camera_params);
  Submap whole{SubmapOptions()};
  Map(&whole);
  EXPECT_NE(Params(whole), scene_.photos[0].camera_params);
  EXPECT_NEAR(Params(whole)[0], options_.camera.focal_px, 8);
  EXPECT_TRUE(whole.map().FixedCameras().empty());
}

TEST_F(KnownCamera, HasAModelOfItsOwn) {
  PhotoInput photo = scene_.photos[0];
  photo.camera_model = "OPENCV";
  photo.camera_params = {1000, 1001, 640, 480, 0.01, 0, 0, 0};
  SceneMap map("SIMPLE_RADIAL");
  ASSERT_TRUE(map.AddPhoto(photo).ok());
  EXPECT_EQ(map.reconstruction().Camera(1).ModelName(), "OPENCV");
  EXPECT_EQ(map.reconstruction().Camera(1).Params(), photo.camera_params);
}

TEST_F(KnownCamera, IsRefusedWithParametersOfAnotherModel) {
  PhotoInput photo = scene_.photos[0];
  photo.camera_model = "OPENCV";
  photo.camera_params = kGiven;
  SceneMap map;
  EXPECT_FALSE(map.AddPhoto(photo).ok());
  photo.camera_model = "NO_SUCH_MODEL";
  EXPECT_FALSE(map.AddPhoto(photo).ok());
  EXPECT_TRUE(map.photos().empty());
}

}  // namespace skein::known_camera_test
