#include "merging/shared_views.h"

#include <gtest/gtest.h>

#include "map/shared_images.h"
#include "testing/synthetic_submaps.h"

namespace skein::shared_views_test {

class SharedViewsTest : public testing::Test {
 protected:
  const Reconstruction model_ = SyntheticWorld(WallOptions(), 1).Submap(1, 4, Similarity(), 1.0);
  SharedImages images_ = SharedImagesOf(model_, {2, 3});
};

TEST_F(SharedViewsTest, AreWhatTheModelHolds) {
  const std::vector<SharedView> views = ViewsOf(images_);
  ASSERT_EQ(views.size(), 2u);
  const Image& image = model_.Image(3);
  EXPECT_EQ(views[1].image_id, 3);
  EXPECT_LT((views[1].cam_from_world.Centre() - image.ProjectionCenter()).norm(), 1e-9);
  EXPECT_EQ(views[1].observations.size(), image.NumPoints3D());
}

TEST_F(SharedViewsTest, CamerasThatColmapDoesNotKnowAreLeftOut) {
  images_[0].camera_model_id = 77;
  images_[1].params.pop_back();
  EXPECT_TRUE(ViewsOf(images_).empty());
}

}  // namespace skein::shared_views_test
