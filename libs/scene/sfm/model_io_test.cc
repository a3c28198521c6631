#include "sfm/model_io.h"

#include <gtest/gtest.h>

#include <cstdint>

#include "testing/synthetic_scene.h"

namespace skein::model_io_test {

class ModelIoTest : public testing::Test {
 protected:
  ModelIoTest() {
    AddToMap(scene_, scene_.pairs, &map_);
    RegisterAtTruth(scene_, {1, 2, 3, 4, 5}, Eigen::Vector3d::Zero(), &map_);
    archive_ = EncodeModel(map_.reconstruction());
  }

  const SyntheticScene scene_ = MakeScene({});
  SceneMap map_;
  ModelArchive archive_;
};

TEST_F(ModelIoTest, ReadsBackWhatWasWritten) {
  const Result<Reconstruction> model = DecodeModel(archive_);
  ASSERT_TRUE(model.ok()) << model.error();
  EXPECT_EQ(model->NumRegImages(), 5u);
  EXPECT_EQ(model->NumPoints3D(), map_.reconstruction().NumPoints3D());
  EXPECT_EQ(model->Image(3).Tvec(), map_.reconstruction().Image(3).Tvec());
  EXPECT_EQ(model->Image(3).NumPoints3D(), map_.reconstruction().Image(3).NumPoints3D());
  EXPECT_EQ(model->Camera(1).Params(), map_.reconstruction().Camera(1).Params());
  EXPECT_EQ(EncodeModel(*model), archive_);
}

TEST_F(ModelIoTest, AMissingFileIsNamed) {
  archive_.erase("points3D.bin");
  const Result<Reconstruction> model = DecodeModel(archive_);
  ASSERT_FALSE(model.ok());
  EXPECT_NE(model.error().find("points3D.bin"), std::string::npos);
}

// COLMAP would abort the process.
TEST_F(ModelIoTest, NoCutOrFlippedByteGetsThroughToColmap) {
  for (const char* name : {"cameras.bin", "images.bin", "points3D.bin"}) {
    const Bytes whole = archive_.at(name);
    for (size_t size = 0; size < whole.size(); size += 1 + size / 2) {
      archive_.at(name).resize(size);
      EXPECT_FALSE(DecodeModel(archive_).ok()) << name << " cut to " << size;
      archive_.at(name) = whole;
    }
    for (size_t at = 0; at < std::min<size_t>(whole.size(), 400); ++at) {
      archive_.at(name)[at] ^= 0x80;
      if (const auto model = DecodeModel(archive_); model.ok()) EncodeModel(*model);
      archive_.at(name) = whole;
    }
  }
}

// Exports hand the names on, and other programs read and write by them.
TEST(ImageNames, LeadNowhereButBelowAFolder) {
  for (const char* name : {"1.jpg", "alice/1.jpg", "a b/..c/x..jpg", "\xc3\xa4/1.jpg"}) {
    EXPECT_TRUE(IsImageName(name)) << name;
  }
  for (const char* name :
       {"", "/etc/passwd", "../1.jpg", "alice/../../1.jpg", "a//1.jpg", "./1.jpg", "alice/..",
        "1.jpg 600 1 0\n5 evil.jpg", "\x1b[2J.jpg", "\xff.jpg"}) {
    EXPECT_FALSE(IsImageName(name)) << name;
  }
}

// Photos 3, 1 and 2 of two cameras; 2 is not registered. Camera 7 has no photo. Points 1 and 3 of
// three.
Reconstruction MakeModel() {
  Reconstruction model;
  for (const CameraId id : {2, 1, 7}) {
    Camera camera;
    camera.SetCameraId(id);
    camera.InitializeWithName("SIMPLE_RADIAL", 1000 + id, 800, 600);
    model.AddCamera(camera);
  }
  for (const ImageId id : {3, 1, 2}) {
    Image image;
    image.SetImageId(id);
    image.SetCameraId(id == 3 ? 2 : 1);
    image.SetName("photo" + std::to_string(id));
    image.SetQvec(Eigen::Vector4d(1, 0.1 * id, 0, 0).normalized());
    image.SetTvec({1.0 * id, 2, 3});
    image.SetPoints2D(std::vector<Eigen::Vector2d>{{10.5, 20}, {30, 40}, {50, 60}});
    model.AddImage(image);
    if (id != 2) model.RegisterImage(id);
  }
  for (Point2DIdx i = 0; i < 3; ++i) {
    Track track;
    track.AddElement(1, i);
    track.AddElement(3, 2 - i);
    model.Point3D(model.AddPoint3D({1.0 * i, 2, 5}, track, Rgb(1, 2, 3))).SetError(0.5);
  }
  model.DeletePoint3D(2);
  return model;
}

TEST(CopyRegistered, IsWhatEncodingAndDecodingGives) {
  const Reconstruction model = MakeModel();
  const Result<Reconstruction> decoded = DecodeModel(EncodeModel(model));
  ASSERT_TRUE(decoded.ok()) << decoded.error();
  EXPECT_EQ(EncodeModel(CopyRegistered(model)), EncodeModel(*decoded));
}

TEST(EncodeModel, LeavesOutCamerasThatNoRegisteredPhotoUses) {
  const Result<Reconstruction> decoded = DecodeModel(EncodeModel(MakeModel()));
  ASSERT_TRUE(decoded.ok()) << decoded.error();
  EXPECT_EQ(decoded->NumCameras(), 2u);
  EXPECT_FALSE(decoded->ExistsCamera(7));
}

TEST(DecodeModel, RefusesAPhotoThatLeadsOutOfItsFolder) {
  Reconstruction model = MakeModel();
  model.Image(3).SetName("../../.ssh/authorized_keys");
  EXPECT_FALSE(DecodeModel(EncodeModel(model)).ok());
}

TEST(DecodeModel, RefusesACameraWithoutSidesOrWithAbsurdOnes) {
  for (const size_t width : {size_t{0}, size_t{1'000'001}, SIZE_MAX}) {
    Reconstruction model = MakeModel();
    model.Camera(1).SetWidth(width);
    EXPECT_FALSE(DecodeModel(EncodeModel(model)).ok()) << width;
  }
}

TEST(DecodeModel, RefusesAKeypointTwiceInATrack) {
  Reconstruction model = MakeModel();
  const Point2D& free = model.Image(1).Point2D(1);
  ASSERT_FALSE(free.HasPoint3D());
  Track track;
  for (const Point2DIdx index : {1, 1}) track.AddElement(1, index);
  EXPECT_FALSE(CanBeAdded(model, track));
  track = Track();
  track.AddElement(1, 1);
  EXPECT_TRUE(CanBeAdded(model, track));
  track.AddElement(1, 0);
  EXPECT_FALSE(CanBeAdded(model, track)) << "it observes another point";
}

// With each element held against all before it, 200,000 took 49 s.
// A comparison of all pairs of elements, 2e12, would not end before the test's limit.
TEST(DecodeModel, ALongTrackTakesNoLongTime) {
  constexpr Point2DIdx kNumElements = 2'000'000;
  Image image;
  image.SetImageId(9);
  image.SetCameraId(1);
  image.SetPoints2D(std::vector<Eigen::Vector2d>(kNumElements, {1, 2}));
  Reconstruction model = MakeModel();
  model.AddImage(image);
  Track track;
  for (Point2DIdx i = 0; i < kNumElements; ++i) track.AddElement(9, i);
  EXPECT_TRUE(CanBeAdded(model, track));
}

TEST(CopyRegistered, LeavesOutWhatIsNotRegistered) {
  const Reconstruction copy = CopyRegistered(MakeModel());
  EXPECT_EQ(copy.NumRegImages(), 2u);
  EXPECT_FALSE(copy.ExistsImage(2));
  EXPECT_TRUE(copy.IsImageRegistered(3));
  EXPECT_EQ(copy.NumPoints3D(), 2u);
}

}  // namespace skein::model_io_test
