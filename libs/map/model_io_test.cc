#include "map/model_io.h"

#include <gtest/gtest.h>

#include "testing/synthetic_scene.h"

namespace skein {
namespace {

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
  const Result<colmap::Reconstruction> model = DecodeModel(archive_);
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
  const Result<colmap::Reconstruction> model = DecodeModel(archive_);
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

}  // namespace
}  // namespace skein
