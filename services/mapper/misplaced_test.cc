#include "mapper/misplaced.h"

#include <gtest/gtest.h>

#include "mapper/bundle_builder.h"
#include "mapper/synthetic_scene.h"

namespace skein {
namespace {

// Photos 1 to 6 at their truth; 7 and 8, with points of their own, as far apart from each other as
// they are, but elsewhere.
class MisplacedTest : public testing::Test {
 protected:
  void SetUp() override {
    for (size_t i = 0; i < scene_.photos.size(); ++i) {
      ASSERT_TRUE(map_.AddPhoto(scene_.photos[i]).ok());
      ASSERT_TRUE(map_.AddPairs(scene_.photos[i].image_id, scene_.pairs[i]).ok());
    }
    Register({1, 2, 3, 4, 5, 6}, Eigen::Vector3d::Zero());
    Register({7, 8}, Eigen::Vector3d(3, 0, 0));
  }

  void Register(const std::vector<ImageId>& ids, const Eigen::Vector3d& shift) {
    std::vector<colmap::Track> tracks(scene_.points.size());
    for (const ImageId id : ids) {
      BundlePose pose;
      pose.R = scene_.rotations[id - 1];
      pose.t = scene_.translations[id - 1] - pose.R * shift;
      SetPose(pose, &map_.reconstruction().Image(id));
      map_.Register(id);
      for (size_t k = 0; k < scene_.visible[id - 1].size(); ++k) {
        tracks[scene_.visible[id - 1][k]].AddElement(id, static_cast<Point2DIdx>(k));
      }
    }
    for (size_t p = 0; p < tracks.size(); ++p) {
      if (tracks[p].Length() < 2) continue;
      map_.reconstruction().AddPoint3D(scene_.points[p] + shift, tracks[p]);
    }
  }

  const SyntheticScene scene_ = MakeScene({});
  SceneMap map_;
};

TEST_F(MisplacedTest, TheSmallerOfTwoGroupsThatContradictEachOtherIsMisplaced) {
  EXPECT_EQ(FindMisplaced({}, map_), std::vector<ImageId>({7, 8}));
}

TEST_F(MisplacedTest, AroundAPhotoTheSameIsFoundWithinReach) {
  EXPECT_EQ(FindMisplacedAround({}, map_, 7), std::vector<ImageId>({7, 8}));
}

TEST_F(MisplacedTest, BeyondTheNearestPhotosNothingIsLookedAt) {
  MisplacedOptions options;
  options.max_photos_around = 3;
  EXPECT_TRUE(FindMisplacedAround(options, map_, 1).empty());
}

}  // namespace
}  // namespace skein
