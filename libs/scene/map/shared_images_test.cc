#include "map/shared_images.h"

#include <gtest/gtest.h>

#include "testing/synthetic_scene.h"

namespace skein::shared_images_test {

TEST(SharedImages, HoldRegisteredImagesWithTheirTriangulatedKeypoints) {
  const SyntheticScene scene = MakeScene({});
  SceneMap map;
  AddToMap(scene, scene.pairs, &map);
  RegisterAtTruth(scene, {1, 2, 3}, Eigen::Vector3d::Zero(), &map);
  const SharedImages images = SharedImagesOf(map.reconstruction(), {2, 7, 99});
  ASSERT_EQ(images.size(), 1u);  // 7 is not registered, 99 not there
  const Image& image = map.reconstruction().Image(2);
  EXPECT_EQ(images[0].image_id, 2);
  EXPECT_EQ(images[0].params, map.reconstruction().Camera(1).Params());
  EXPECT_EQ(images[0].points.size(), image.NumPoints3D());
  const SharedPoint& point = images[0].points.front();
  const Point2D& point2D = image.Point2D(point.point2D_idx);
  EXPECT_FLOAT_EQ(point.u, static_cast<float>(point2D.X()));
  EXPECT_EQ(point.xyz[2], map.reconstruction().Point3D(point2D.Point3DId()).XYZ().z());
}

}  // namespace skein::shared_images_test
