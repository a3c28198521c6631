#include "geometry/model_poses.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>

namespace skein::model_poses_test {

namespace fs = std::filesystem;

class ModelPosesTest : public ::testing::Test {
 protected:
  ModelPosesTest() {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() /
              ("skein_poses_" + std::string(info->name()) + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  ~ModelPosesTest() override { fs::remove_all(folder_); }

  fs::path Write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }

  fs::path folder_;
};

TEST_F(ModelPosesTest, ReadsColmapTextWithEmptyPointLines) {
  Write("images.txt", "# c\n1 1 0 0 0 1 2 3 1 a/x y.jpg\n\n2 0 1 0 0 4 5 6 1 b.jpg\n1 2 -1\n");
  const auto model = ReadPoses(folder_);
  ASSERT_TRUE(model.ok()) << model.error();
  ASSERT_EQ(model->poses.size(), 2u);
  EXPECT_EQ(model->poses[0].name, "a/x y.jpg");
  EXPECT_EQ(model->poses[0].pose.Centre(), Eigen::Vector3d(-1, -2, -3));
  EXPECT_EQ(model->points.points, 0u);
}

TEST_F(ModelPosesTest, CountsPointsOfTextModels) {
  Write("images.txt", "1 1 0 0 0 1 2 3 1 a.jpg\n\n");
  Write("points3D.txt", "1 0 0 0 9 9 9 0.5 1 0 2 0\n2 0 0 0 9 9 9 1.5 1 1 2 1 3 1 4 1\n");
  const auto model = ReadPoses(folder_);
  ASSERT_TRUE(model.ok()) << model.error();
  EXPECT_EQ(model->points.points, 2u);
  EXPECT_DOUBLE_EQ(model->points.mean_reprojection_error_px, 1.0);
  EXPECT_DOUBLE_EQ(model->points.mean_track_length, 3.0);
}

TEST_F(ModelPosesTest, TruncatedBinaryIsAnErrorNotACrash) {
  Write("images.bin", std::string("\x05\0\0\0\0\0\0\0\x01\0\0\0", 12));
  const auto model = ReadPoses(folder_);
  ASSERT_FALSE(model.ok());
  EXPECT_NE(model.error().find("damaged"), std::string::npos);
}

TEST_F(ModelPosesTest, ReadsStrechaCameraToWorld) {
  Write("0000.jpg.camera", "1 0 0\n0 1 0\n0 0 1\n0 0 0\n0 0 1\n1 0 0\n0 1 0\n7 8 9\n100 50\n");
  const auto model = ReadPoses(folder_);
  ASSERT_TRUE(model.ok()) << model.error();
  ASSERT_EQ(model->poses.size(), 1u);
  EXPECT_EQ(model->poses[0].name, "0000.jpg");
  EXPECT_LT((model->poses[0].pose.Centre() - Eigen::Vector3d(7, 8, 9)).norm(), 1e-12);
  // The camera's z axis is the third column of camera-to-world.
  EXPECT_LT((model->poses[0].pose.rotation.conjugate() * Eigen::Vector3d::UnitZ() -
             Eigen::Vector3d::UnitX())
                .norm(),
            1e-12);
}

TEST_F(ModelPosesTest, ReadsTumPosesInTheWorld) {
  const double s = std::sqrt(0.5);
  const fs::path file =
      Write("t.tum", "# time\n1.5 1 2 3 0 0 " + std::to_string(s) + " " + std::to_string(s) + "\n");
  const auto model = ReadPoses(file);
  ASSERT_TRUE(model.ok()) << model.error();
  EXPECT_TRUE(model->numbered);
  EXPECT_LT((model->poses[0].pose.Centre() - Eigen::Vector3d(1, 2, 3)).norm(), 1e-5);
  EXPECT_LT((model->poses[0].pose.rotation.conjugate() * Eigen::Vector3d::UnitX() -
             Eigen::Vector3d::UnitY())
                .norm(),
            1e-5);
}

TEST_F(ModelPosesTest, ReadsMiddleburyParameters) {
  const fs::path file =
      Write("t_par.txt", "1\nt1.png 1 0 0 0 1 0 0 0 1 1 0 0 0 1 0 0 0 1 0.1 0.2 0.3\n");
  const auto model = ReadPoses(file);
  ASSERT_TRUE(model.ok()) << model.error();
  EXPECT_EQ(model->poses[0].pose.translation, Eigen::Vector3d(0.1, 0.2, 0.3));
}

TEST_F(ModelPosesTest, EmptyFolderIsAnErrorThatSaysWhatWasExpected) {
  const auto model = ReadPoses(folder_);
  ASSERT_FALSE(model.ok());
  EXPECT_NE(model.error().find("images.bin"), std::string::npos);
}

TEST_F(ModelPosesTest, NonsenseIsAnError) {
  EXPECT_FALSE(ReadPoses(Write("x.tum", "hello world\n")).ok());
  EXPECT_FALSE(ReadPoses(folder_ / "missing").ok());
}

}  // namespace skein::model_poses_test
