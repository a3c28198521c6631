#include "guide/sentences.h"

#include <gtest/gtest.h>

#include "testing/test_poses.h"

namespace skein::sentences_test {

constexpr double kDegree = 3.14159265358979323846 / 180;

// Level, facing +y, turned to the right and upwards.
CameraPose Pose(const Eigen::Vector3d& centre, double right_deg = 0, double up_deg = 0) {
  const Eigen::Vector3d z =
      Eigen::AngleAxisd(-right_deg * kDegree, Eigen::Vector3d::UnitZ()) *
      (Eigen::AngleAxisd(up_deg * kDegree, Eigen::Vector3d::UnitX()) * Eigen::Vector3d::UnitY());
  return LookingAt(centre, centre + z);
}

std::string Say(const Wording& wording, const CameraPose& near, const CameraPose& there,
                Station::Why why = Station::Why::kFewPhotos) {
  Station station;
  station.cam_from_world = there;
  station.why = why;
  return StationSentence(wording, "alice/0031.jpg", near, station);
}

TEST(StationSentence, IsInMetresWhereTheScaleIsKnown) {
  const Wording wording{Eigen::Vector3d::UnitZ(), 2, 5};
  EXPECT_EQ(
      Say(wording, Pose({0, 0, 0}), Pose({-1.05, 0, 0}, 20)),
      "2.1 m to the left from where alice/0031.jpg was taken, turned 20 degrees to the right: "
      "too few photos see this place");
  EXPECT_EQ(Say(wording, Pose({0, 0, 0}), Pose({0, 8, 0.4})),
            "16 m forward from where alice/0031.jpg was taken: too few photos see this place");
  EXPECT_EQ(Say(wording, Pose({0, 0, 0}), Pose({0.1, -0.4, 0.35}), Station::Why::kTooFar),
            "80 cm back and 70 cm higher from where alice/0031.jpg was taken: the photos of this "
            "place were taken from too far away");
}

TEST(StationSentence, IsInPartsOfTheDistanceElse) {
  const Wording wording{Eigen::Vector3d::UnitZ(), 0, 4};
  EXPECT_EQ(Say(wording, Pose({0, 0, 0}), Pose({-1, 0, 0})),
            "a quarter of the distance to the object, to the left from where alice/0031.jpg was "
            "taken: too few photos see this place");
  EXPECT_EQ(Say(wording, Pose({0, 0, 0}), Pose({16, 0, 0})).find("4 times the distance to the"),
            0u);
  EXPECT_EQ(Say(wording, Pose({0, 0, 0}), Pose({8, 0, 0})).find("twice the distance to the"), 0u);
}

TEST(StationSentence, NamesTheDistanceOnce) {
  const Wording wording{Eigen::Vector3d::UnitZ(), 0, 4};
  EXPECT_EQ(Say(wording, Pose({0, 0, 0}), Pose({1.4, -1, 0.4})),
            "a third of the distance to the object, to the right and a quarter back "
            "from where alice/0031.jpg was taken: too few photos see this place");
}

TEST(StationSentence, GoesByWhereThePhotographerFaced) {
  const Wording wording{Eigen::Vector3d::UnitZ(), 1, 5};
  // Facing +x: +y is to the left.
  EXPECT_EQ(Say(wording, Pose({0, 0, 0}, 90), Pose({0, 2, 0}, 90)).find("2.0 m to the left"), 0u);
  // Looking straight down, with the photo's upper side to +y.
  CameraPose down;
  Eigen::Matrix3d rotation;
  rotation << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  down.rotation = Eigen::Quaterniond(rotation);
  CameraPose there = down;
  there.translation = -(there.rotation * Eigen::Vector3d(0, 3, 0));
  EXPECT_EQ(Say(wording, down, there).find("3.0 m forward"), 0u);
  there.translation = -(there.rotation * Eigen::Vector3d(0, 0, -3));
  EXPECT_EQ(Say(wording, down, there).find("3.0 m lower"), 0u);
}

TEST(StationSentence, SaysTurnAndTilt) {
  const Wording wording{Eigen::Vector3d::UnitZ(), 1, 5};
  EXPECT_EQ(
      Say(wording, Pose({0, 0, 0}), Pose({0, 0, 0}, -31, -14)),
      "where alice/0031.jpg was taken, turned 30 degrees to the left, tilted 15 degrees down: "
      "too few photos see this place");
  EXPECT_NE(Say(wording, Pose({0, 0, 0}), Pose({0, 0, 0}, 180)).find("turned 180 degrees:"),
            std::string::npos);
  EXPECT_NE(Say(wording, Pose({0, 0, 0}), Pose({0, 0, 0}, 3, 25)).find("tilted 25 degrees up"),
            std::string::npos);
}

}  // namespace skein::sentences_test
