#include "sfm/model_files.h"

#include <gtest/gtest.h>

#include <fstream>

#include "sfm/model_io.h"
#include "testing/synthetic_scene.h"
#include "testing/test_folder.h"

namespace skein::model_files_test {

class ModelFiles : public testing::Test {
 protected:
  ModelFiles() {
    AddToMap(scene_, scene_.pairs, &map_);
    RegisterAtTruth(scene_, {1, 2, 3, 4, 5}, Eigen::Vector3d::Zero(), &map_);
  }

  const Reconstruction& model() const { return map_.reconstruction(); }

  const SyntheticScene scene_ = MakeScene({});
  SceneMap map_;
  TestFolder folder_;
};

TEST_F(ModelFiles, TextReadsBackToTheBit) {
  ASSERT_TRUE(WriteModelText(model(), folder_.path()).ok());
  const Result<Reconstruction> read = ReadModelFiles(folder_.path());
  ASSERT_TRUE(read.ok()) << read.error();
  EXPECT_EQ(EncodeModel(*read), EncodeModel(CopyRegistered(model())));
}

TEST_F(ModelFiles, BinaryIsReadInPlaceOfText) {
  ASSERT_TRUE(WriteModelText(model(), folder_.path()).ok());
  ASSERT_TRUE(WriteModelBinary(model(), folder_.path()).ok());
  std::ofstream(folder_.path() / "points3D.txt") << "nonsense\n";
  const Result<Reconstruction> read = ReadModelFiles(folder_.path());
  ASSERT_TRUE(read.ok()) << read.error();
  EXPECT_EQ(EncodeModel(*read), EncodeModel(CopyRegistered(model())));
}

TEST_F(ModelFiles, ADamagedOrMissingFileIsNamed) {
  ASSERT_TRUE(WriteModelText(model(), folder_.path()).ok());
  std::ofstream(folder_.path() / "points3D.txt") << "1 0 0 0 9 9 9 0.5 1 0 1 0\n";
  const Result<Reconstruction> twice = ReadModelFiles(folder_.path());
  ASSERT_FALSE(twice.ok()) << "a keypoint twice in a track";
  EXPECT_NE(twice.error().find("points3D.txt"), std::string::npos);
  std::filesystem::remove(folder_.path() / "images.txt");
  const Result<Reconstruction> missing = ReadModelFiles(folder_.path());
  ASSERT_FALSE(missing.ok());
  EXPECT_NE(missing.error().find("images.txt"), std::string::npos);
}

}  // namespace skein::model_files_test
