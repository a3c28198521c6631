#include "mapping/fold_back.h"

#include <gtest/gtest.h>

#include "map/bundle_builder.h"
#include "testing/synthetic_scene.h"

namespace skein::fold_back_test {

// It was withdrawn and registered elsewhere while the bundle was refined.
TEST(FoldBack, APhotoThatIsConstantInTheBundleFollowsItsAnchor) {
  const SyntheticScene scene = MakeScene({});
  SceneMap map;
  AddToMap(scene, scene.pairs, &map);
  RegisterAtTruth(scene, map.photos(), Eigen::Vector3d::Zero(), &map);
  Bundle refined = BuildGlobalBundle(map, false);
  const Eigen::Vector3d shift(0.3, 0, 0);
  for (BundlePose& pose : refined.poses) pose.t -= pose.R * shift;
  for (BundlePoint& point : refined.points) point.xyz += shift;
  BundlePose& former = refined.poses.back();
  const ImageId id = former.image_id;
  const Eigen::Vector3d before = map.reconstruction().Image(id).ProjectionCenter();
  former.t.x() += 5;
  former.constant = true;
  EXPECT_EQ(FoldBack(refined, &map), std::vector<ImageId>{id});
  EXPECT_LT((map.reconstruction().Image(id).ProjectionCenter() - before - shift).norm(), 1e-6);
}

}  // namespace skein::fold_back_test
