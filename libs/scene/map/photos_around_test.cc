#include "map/photos_around.h"

#include <gtest/gtest.h>

#include "testing/synthetic_scene.h"

namespace skein::photos_around_test {

TEST(PhotosAround, AreTheNearestFirst) {
  const SyntheticScene scene = MakeScene({});
  SceneMap map;
  AddToMap(scene, scene.pairs, &map);
  RegisterAtTruth(scene, map.photos(), Eigen::Vector3d::Zero(), &map);
  const std::vector<ImageId> around = RegisteredAround(map, {7}, 4);
  EXPECT_EQ(around.size(), 4u);
  EXPECT_EQ(around[0], 7u);
  for (const ImageId id : around) EXPECT_TRUE(id == 7 || map.Neighbours(7).count(id) > 0) << id;
  EXPECT_EQ(RegisteredAround(map, {7, 2}, 1), (std::vector<ImageId>{7}));
  EXPECT_EQ(RegisteredAround(map, {7, 2}, 100).size(), 8u) << "each once";
}

}  // namespace skein::photos_around_test
