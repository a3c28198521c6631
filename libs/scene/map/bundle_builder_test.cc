#include "map/bundle_builder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "testing/synthetic_scene.h"

namespace skein::bundle_builder_test {

// Two images of constant points, `error_px` beside where they are seen.
Bundle MakePriorBundle(int num_observations, double error_px) {
  Bundle bundle;
  bundle.poses.resize(2);
  bundle.cameras.resize(1);
  BundleCamera& camera = bundle.cameras[0];
  Camera pinhole;
  pinhole.InitializeWithName("SIMPLE_PINHOLE", 1000, 1200, 900);
  camera.model_id = pinhole.ModelId();
  camera.params = camera.prior = pinhole.Params();
  camera.prior_sigma = {100, 0, 10};
  camera.refined = {0};
  for (int i = 0; i < num_observations; ++i) {
    bundle.points.push_back({0, Eigen::Vector3d::UnitZ(), i, 1, true});
    bundle.observations.push_back({i % 2, 0, Eigen::Vector2d(600 + error_px, 450)});
  }
  return bundle;
}

// The median error of Gaussian noise in two coordinates, in standard deviations.
const double kMedianError = std::sqrt(2 * std::log(2));

TEST(ScalePriors, ObservationsBeyondAHundredAnImageDontOutweighACamerasPrior) {
  for (const int num_observations : {200, 200 * 16}) {
    Bundle bundle = MakePriorBundle(num_observations, kMedianError);
    ScalePriors(&bundle);
    const double factor = num_observations == 200 ? 1 : 4;
    EXPECT_NEAR(bundle.cameras[0].prior_sigma[0], 100 / factor, 1e-9);
    EXPECT_EQ(bundle.cameras[0].prior_sigma[1], 0);
    EXPECT_NEAR(bundle.cameras[0].prior_sigma[2], 10 / factor, 1e-9);
  }
}

TEST(ScalePriors, ThePriorIsAsWeakAsTheObservationsAreSharp) {
  Bundle bundle = MakePriorBundle(200, 0.2 * kMedianError);
  ScalePriors(&bundle);
  EXPECT_NEAR(bundle.cameras[0].prior_sigma[0], 500, 1e-9);
}

// Two observations a point: three of four coordinates fit the point, so the noise is twice the
// error.
TEST(ScalePriors, CoordinatesThatPointsFitAreNotCounted) {
  Bundle bundle = MakePriorBundle(200, 0.2 * kMedianError);
  bundle.points.clear();
  for (int i = 0; i < 100; ++i) bundle.points.push_back({0, Eigen::Vector3d::UnitZ(), 2 * i, 2});
  ScalePriors(&bundle);
  EXPECT_NEAR(bundle.cameras[0].prior_sigma[0], 250, 1e-9);
}

TEST(ScalePriors, WithoutARefinedCameraPriorsStayAsTheyAre) {
  Bundle bundle = MakePriorBundle(200, 0.2 * kMedianError);
  bundle.cameras[0].refined.clear();
  ScalePriors(&bundle);
  EXPECT_EQ(bundle.cameras[0].prior_sigma[0], 100);
}

TEST(ScalePriors, ErrorsThatAreZeroLeaveAFinitePrior) {
  Bundle bundle = MakePriorBundle(200, 0);
  ScalePriors(&bundle);
  EXPECT_GT(bundle.cameras[0].prior_sigma[0], 1000);
  EXPECT_TRUE(std::isfinite(bundle.cameras[0].prior_sigma[0]));
  EXPECT_EQ(bundle.cameras[0].prior_sigma[1], 0);
}

void MapAtTruth(const SyntheticScene& scene, SceneMap* map) {
  AddToMap(scene, scene.pairs, map);
  RegisterAtTruth(scene, map->photos(), Eigen::Vector3d::Zero(), map);
}

class BuildBundleTest : public testing::Test {
 protected:
  void SetUp() override {
    MapAtTruth(scene_, &map_);
    request_.free = {8};
    request_.held = {7};
  }

  const SyntheticScene scene_ = MakeScene({});
  SceneMap map_;
  BundleRequest request_;
};

// What a held pose sees of a constant point says nothing.
TEST_F(BuildBundleTest, PointsSeenFromOutsideAreConstantAndHaveTheFreePosesObservations) {
  request_.points = PointsSeenBy(map_, request_.free);
  request_.hold_open_points = true;
  const Bundle bundle = BuildBundle(map_, request_);
  ASSERT_EQ(bundle.poses.size(), 2u);
  size_t num_constant = 0;
  for (const BundlePoint& point : bundle.points) {
    const bool is_open = map_.reconstruction().Point3D(point.point3D_id).Track().Length() > 2;
    EXPECT_EQ(point.constant, is_open);
    EXPECT_EQ(point.count, is_open ? 1 : 2);
    num_constant += point.constant;
  }
  EXPECT_GT(num_constant, 100u);
}

// But for a camera that is refined.
TEST_F(BuildBundleTest, ConstantPointsHaveAllObservationsByARefinedCamera) {
  request_.points = PointsSeenBy(map_, request_.free);
  request_.hold_open_points = request_.refine_cameras = true;
  size_t num_of_both = 0;
  for (const BundlePoint& point : BuildBundle(map_, request_).points) {
    num_of_both += point.constant && point.count == 2;
  }
  EXPECT_GT(num_of_both, 100u);
}

TEST_F(BuildBundleTest, CompletePointsHaveTheirObservationsByAllImages) {
  request_.complete_points = PointsSeenBy(map_, request_.free);
  request_.hold_open_points = true;
  const Bundle bundle = BuildBundle(map_, request_);
  EXPECT_EQ(bundle.points.size(), request_.complete_points.size());
  for (const BundlePoint& point : bundle.points) {
    EXPECT_FALSE(point.constant);
    EXPECT_EQ(point.count, map_.reconstruction().Point3D(point.point3D_id).Track().Length());
  }
  EXPECT_EQ(bundle.poses.size(), scene_.photos.size());
  for (size_t i = 0; i < bundle.poses.size(); ++i) EXPECT_EQ(bundle.poses[i].constant, i > 0);
}

TEST(BundleOfSome, HoldsEnoughObservationsOfEachImage) {
  SyntheticOptions options;
  options.num_points = 6000;
  SceneMap map;
  MapAtTruth(MakeScene(options), &map);
  const Bundle whole = BuildGlobalBundle(map, true), some = BuildBundleOfSome(map, true);
  ASSERT_EQ(some.poses.size(), whole.poses.size());
  EXPECT_LT(2 * some.observations.size(), whole.observations.size());
  std::vector<int> num_observations(some.poses.size()), num_of_all(some.poses.size());
  for (const BundleObservation& o : some.observations) ++num_observations[o.pose];
  for (const BundleObservation& o : whole.observations) ++num_of_all[o.pose];
  for (size_t i = 0; i < some.poses.size(); ++i) {
    EXPECT_GE(num_observations[i], std::min(kObservationsOfSome, num_of_all[i]));
  }
}

TEST(BundleOfSome, HoldsNotAllImagesOfALargeMap) {
  SyntheticOptions options;
  options.num_photos = static_cast<int>(kImagesOfSome) + 10;
  options.num_points = 100;
  SceneMap map;
  MapAtTruth(MakeScene(options), &map);
  const Bundle some = BuildBundleOfSome(map, true);
  EXPECT_EQ(some.poses.size(), kImagesOfSome);
  std::vector<int> num_observations(some.poses.size());
  for (const BundleObservation& o : some.observations) ++num_observations[o.pose];
  EXPECT_GT(*std::min_element(num_observations.begin(), num_observations.end()), 10);
}

}  // namespace skein::bundle_builder_test
