#include "sfm/database.h"

#include <gtest/gtest.h>

#include "testing/test_folder.h"

namespace skein::database_test {

TEST(ColmapDatabase, ReadsBackWhatWasWritten) {
  const TestFolder folder;
  const std::string file = (folder.path() / "database.db").string();
  TwoViewGeometry geometry;
  geometry.config = TwoViewGeometry::CALIBRATED;
  geometry.E(0, 1) = 3;
  geometry.qvec = Eigen::Vector4d(1, 0, 0, 0);
  geometry.tvec = Eigen::Vector3d(0, 1, 0);
  geometry.inlier_matches = {{0, 1}, {1, 0}};
  {
    ColmapDatabase database(file);
    Camera camera;
    camera.InitializeWithName("SIMPLE_RADIAL", 500, 640, 480);
    camera.SetCameraId(7);
    camera.SetPriorFocalLength(true);
    EXPECT_EQ(database.WriteCamera(camera), 7u);
    database.WriteImage(1, 7, "alice/1.jpg");
    database.WriteImage(2, 7, "alice/2.jpg");
    database.WriteKeypoints(1, {{10, 20, 2, 0.5F, 0, 0, 0}, {30, 40, 3, 0, 0, 0, 0}});
    database.WriteMatches(1, 2, geometry.inlier_matches);
    database.WriteTwoViewGeometry(1, 2, geometry);
  }
  const ColmapDatabase database(file);
  EXPECT_TRUE(database.ExistsCamera(7));
  EXPECT_FALSE(database.ExistsCamera(8));
  EXPECT_TRUE(database.ReadCamera(7).HasPriorFocalLength());
  EXPECT_EQ(database.ReadCamera(7).Params(), (std::vector<double>{500, 320, 240, 0}));
  ASSERT_EQ(database.ReadAllImages().size(), 2u);
  EXPECT_EQ(database.ReadAllImages()[1].Name(), "alice/2.jpg");
  ASSERT_EQ(database.ReadKeypoints(1).size(), 2u);
  EXPECT_NEAR(database.ReadKeypoints(1)[0].angle_rad, 0.5, 1e-6);
  EXPECT_TRUE(database.ExistsMatches(1, 2));
  const TwoViewGeometry read = database.ReadTwoViewGeometry(1, 2);
  EXPECT_EQ(read.config, TwoViewGeometry::CALIBRATED);
  EXPECT_EQ(read.E, geometry.E);
  EXPECT_EQ(read.tvec, geometry.tvec);
  ASSERT_EQ(read.inlier_matches.size(), 2u);
  EXPECT_EQ(read.inlier_matches[0].point2D_idx2, 1u);
}

}  // namespace skein::database_test
