#include "clients/places/truth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "testing/test_plate.h"

namespace skein::sim {
namespace truth_test {

TEST(Truth, TracksLeaveOutPhotosWhereAPasserByHidesThePoint) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "skein_sim_truth_test";
  const Place place = PlateBeforeWall({0, 4.9f, 0});
  const std::vector<Camera> cameras = {{160, 120, 140, 0}};
  const Pose left = LookAt({-0.3, 0, 0}, {0, 5, 0}, 0), right = LookAt({0.3, 0, 0}, {0, 5, 0}, 0);
  const auto num_points = [&](const Scene& moving) {
    WriteTruth(folder.string(), place, cameras, {{"a/1", 0, left, {}}, {"a/2", 0, right, moving}},
               1, 1);
    std::ifstream file(folder / "points3D.txt");
    return std::count(std::istreambuf_iterator<char>(file), {}, '\n');
  };
  EXPECT_GT(num_points(Scene()), 200);
  EXPECT_EQ(num_points(Scene({FacingSouth({0.3f, 1, 0}, 5, 0)})), 0);
  std::filesystem::remove_all(folder);
}

}  // namespace truth_test
}  // namespace skein::sim
