#include "guidance/model_map.h"

#include <gtest/gtest.h>

#include "guidance/place_summary.h"
#include "testing/synthetic_scene.h"

namespace skein::model_map_test {

class ModelMapTest : public testing::Test {
 protected:
  static SyntheticOptions Options() {
    SyntheticOptions options;
    options.shape = SyntheticOptions::Shape::kWall;
    options.num_photos = 12;
    options.num_points = 4000;
    options.second_camera_from = 7;
    return options;
  }
  ModelMapTest() { FillMap(scene_, &map_); }

  const SyntheticScene scene_ = MakeScene(Options());
  SceneMap map_;
};

TEST_F(ModelMapTest, HasThePhotosAndThePoints) {
  const Reconstruction& model = map_.reconstruction();
  const GuidedMap map = MapOfModel(model, 1'000'000);
  ASSERT_EQ(map.photos.size(), 12u);
  EXPECT_EQ(map.points.size(), model.NumPoints3D());
  ASSERT_EQ(map.cameras.size(), 2u);
  EXPECT_EQ(map.cameras[0].width_px, 1200);
  EXPECT_EQ(map.cameras[0].fx_px, 1000);
  EXPECT_EQ(map.cameras[0].cx_px, 600);
  for (size_t i = 0; i < map.photos.size(); ++i) {
    EXPECT_EQ(map.photos[i].image_id, static_cast<int64_t>(i + 1));
    EXPECT_EQ(map.photos[i].camera, i < 6 ? 0 : 1);
    EXPECT_LT((map.photos[i].cam_from_world.Centre() - scene_.Center(i)).norm(), 1e-9);
  }
  for (const GuidedPoint& point : map.points) {
    ASSERT_GE(point.photos.size(), 2u);
    for (const uint32_t photo : point.photos) {
      const GuidedPhoto& seen_by = map.photos[photo];
      Eigen::Vector2d pixel(-1e9, -1e9);
      map.cameras[seen_by.camera].Project(seen_by.cam_from_world.Apply(point.xyz), &pixel);
      EXPECT_LT((pixel - Eigen::Vector2d(600, 450)).cwiseAbs().x(), 605) << "up to the noise";
      EXPECT_LT((pixel - Eigen::Vector2d(600, 450)).cwiseAbs().y(), 455);
    }
  }
}

TEST_F(ModelMapTest, OfManyPointsAPartSaysTheSame) {
  const Reconstruction& model = map_.reconstruction();
  const auto summary_of = [&](size_t max_points) {
    const GuidedMap map = MapOfModel(model, max_points);
    EXPECT_LE(map.points.size(), max_points);
    return SummarisePlace(AssessPlace(map), map.photos.size());
  };
  const PlaceSummary all = summary_of(10'000), half = summary_of(model.NumPoints3D() / 2);
  EXPECT_GT(all.num_surfels, 20u);
  EXPECT_NEAR(half.completeness.good_share, all.completeness.good_share, 0.15);
  EXPECT_EQ(MapOfModel(Reconstruction(), 10).points.size(), 0u);
}

}  // namespace skein::model_map_test
