#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "mapping/checkpoint.h"
#include "testing/submap_rig.h"

namespace skein::submap_cameras_test {

TEST(Submap, RecoversAFocalPriorThatIsWrongByAQuarterAndDistortion) {
  for (const double factor : {0.75, 1.25}) {
    for (const bool exif : {false, true}) {
      SyntheticOptions options;
      options.num_photos = 16;
      options.prior_factor = factor;
      options.focal_from_exif = exif;
      options.camera.distortion = -0.1;
      SubmapRig run(options);
      run.FeedAll();
      run.map.Finish(run.Sink());
      EXPECT_EQ(run.NumRegistered(), 16) << factor << exif;
      EXPECT_NEAR(run.Focal(), 1000, 5) << factor << exif;
    }
  }
}

// The longer side in place of the diagonal is 4 % of the focal length in 35 mm.
TEST(Submap, APriorThatIsWrongBy4PercentShiftsNoMapOfSharpPhotos) {
  SyntheticOptions options;
  options.num_photos = 4;
  options.num_points = 3000;
  options.prior_factor = 1.04;
  options.noise_px = 0.05;
  SubmapRig run(options);
  run.FeedAll();
  run.map.Finish(run.Sink());
  EXPECT_NEAR(run.Focal(), 1000, 1);
}

TEST(Submap, TakesOtherCameraModels) {
  for (const char* model :
       {"PINHOLE", "RADIAL", "OPENCV", "FULL_OPENCV", "SIMPLE_RADIAL_FISHEYE"}) {
    SubmapOptions submap;
    submap.camera_model = model;
    SyntheticOptions options;
    options.num_photos = 14;
    options.prior_factor = 1.1;
    SubmapRig run(options, submap);
    run.FeedAll();
    run.map.Finish(run.Sink());
    EXPECT_EQ(run.NumRegistered(), 14) << model;
    // A fisheye's projection is not the scene's: it must come close, though.
    const bool fisheye = std::string(model).find("FISHEYE") != std::string::npos;
    EXPECT_LT(run.PositionErrorPercent(), fisheye ? 5.0 : 0.5) << model;
  }
}

double FocalOf(const Submap& map, ImageId id) {
  const Reconstruction& reconstruction = map.map().reconstruction();
  return reconstruction.Camera(reconstruction.Image(id).CameraId()).Params(0);
}

TEST(Submap, FocalLengthWithstandsAFewZoomedPhotos) {
  SyntheticOptions options;
  options.num_photos = 16;
  options.prior_factor = 1.1;
  options.zoomed_photos = {5, 11};
  SubmapRig run(options);
  run.FeedAll();
  run.map.Finish(run.Sink());
  EXPECT_NEAR(FocalOf(run.map, 1), 1000, 10);
  EXPECT_GE(run.NumRegistered(), 14);
}

// Photos of one size without EXIF count as of one camera, until one does not fit.
TEST(Submap, WithoutExifAZoomedPhotoGetsIntrinsicsOfItsOwn) {
  SyntheticOptions options;
  options.num_photos = 16;
  options.focal_from_exif = false;
  options.zoomed_photos = {5, 11};
  SubmapRig run(options);
  run.FeedAll();
  run.map.Finish(run.Sink());
  EXPECT_EQ(run.NumRegistered(), 16);
  EXPECT_LT(run.PositionErrorPercent(), 0.5);
  for (ImageId id = 1; id <= 16; ++id) {
    const bool zoomed = id == 6 || id == 12;
    EXPECT_NEAR(FocalOf(run.map, id), zoomed ? 1300 : 1000, 10) << id;
    EXPECT_EQ(run.map.map().reconstruction().Image(id).CameraId(),
              zoomed ? SceneMap::OwnCamera(id) : 1);
  }
  SubmapRig other(options);
  for (size_t i = 0; i < 16; ++i) other.Add(i);
  ASSERT_TRUE(RestoreSubmap(SaveSubmap(&run.map), &other.map).ok());
  EXPECT_NEAR(FocalOf(other.map, 6), 1300, 10);
}

// One focal length for all of them would fit well, and bend the map.
TEST(Submap, PhotosThatWereZoomedEachGetIntrinsicsOfTheirOwn) {
  for (const bool exif : {false, true}) {
    SyntheticOptions options;
    options.num_photos = 16;
    options.focal_from_exif = exif;
    options.zoomed_photos = {1, 3, 4, 7, 9, 10, 12, 15};
    SubmapRig run(options);
    run.FeedAll();
    run.map.Finish(run.Sink());
    EXPECT_EQ(run.NumRegistered(), 16) << exif;
    EXPECT_LT(run.PositionErrorPercent(), 0.5) << exif;
    for (ImageId id = 1; id <= 16; ++id) {
      const std::vector<int>& ids = options.zoomed_photos;
      const bool zoomed = std::count(ids.begin(), ids.end(), static_cast<int>(id) - 1) > 0;
      EXPECT_NEAR(FocalOf(run.map, id), zoomed ? 1300 : 1000, 15) << exif << ", " << id;
    }
  }
}

TEST(Submap, LocalBundleAdjustmentsLeaveTheIntrinsics) {
  SyntheticOptions options;
  options.num_photos = 16;
  SubmapOptions submap;
  submap.global_growth = 100;
  SubmapRig run(options, submap);
  ASSERT_TRUE(run.Start(0, 2));
  for (size_t i = 1; i < 13; ++i) {
    if (i != 2) run.Feed(i);
  }
  const std::vector<double> params = run.map.map().reconstruction().Camera(1).Params();
  for (size_t i = 13; i < 16; ++i) run.Feed(i);
  EXPECT_EQ(run.NumRegistered(), 16);
  EXPECT_EQ(run.map.map().reconstruction().Camera(1).Params(), params);
}

}  // namespace skein::submap_cameras_test
