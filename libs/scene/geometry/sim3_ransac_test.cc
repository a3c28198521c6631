#include "geometry/sim3_ransac.h"

#include <gtest/gtest.h>

#include "geometry/sim3_score.h"
#include "testing/synthetic_scene.h"
#include "testing/test_random.h"

namespace skein::sim3_ransac_test {

using Path = SyntheticOptions::Path;

// Two submaps of one scene.
struct World {
  double scale = 1.0;
  double depth_noise = 0.0;   // relative, of each submap's points along the viewing ray
  double wrong_points = 0.0;  // share of points whose target side is another point
  int num_wrong_images = 0;   // photos whose target pose is arbitrary
  int num_images = 6;
  Path path = Path::kArc;  // kForward: centres on a line; kRotation: in one spot
  double target_focal_factor = 1.0;
};

class Scene {
 public:
  Scene(const World& world, unsigned seed) : random_(seed) {
    truth_.scale = world.scale;
    truth_.rotation = RandomRotation(&random_);
    truth_.translation = Uniform3(-10, 10, &random_);
    options_.seed = seed;
    options_.num_photos = world.num_images;
    options_.num_points = 300;
    options_.path = world.path;
    options_.camera.width_px = 1600;
    options_.camera.height_px = 1200;
    options_.camera.focal_px = 1300;
    options_.camera.distortion = -0.05;
    const SyntheticScene scene = MakeScene(options_);
    for (int i = 0; i < world.num_images; ++i) AddImage(world, scene, i);
  }

  std::vector<SharedPhoto> shared_;
  Similarity truth_;

 private:
  void AddImage(const World& world, const SyntheticScene& scene, int i) {
    SharedPhoto image;
    image.image_id = 100 + i;
    image.source_camera.InitializeWithName("SIMPLE_RADIAL", options_.camera.focal_px,
                                           options_.camera.width_px, options_.camera.height_px);
    image.source_camera.Params()[3] = options_.camera.distortion;
    image.target_camera = image.source_camera;
    image.target_camera.Params()[0] *= world.target_focal_factor;
    image.cam_from_source = {Eigen::Quaterniond(scene.rotations[i]), scene.translations[i]};
    image.cam_from_target = TransformPose(truth_, image.cam_from_source);
    for (size_t k = 0; k < scene.visible[i].size(); ++k) {
      const Keypoint& keypoint = scene.photos[i].keypoints[k];
      const Eigen::Vector3d& xyz = scene.points[scene.visible[i][k]];
      SharedPhoto::CommonPoint point;
      point.point2D_idx = static_cast<uint32_t>(k);
      point.source_xyz = MovedInDepth(world.depth_noise, scene.Center(i), xyz);
      point.target_xyz = truth_.Apply(MovedInDepth(world.depth_noise, scene.Center(i), xyz));
      point.pixel = {keypoint.x, keypoint.y};
      image.points.push_back(point);
    }
    SpoilPoints(world.wrong_points, &image);
    if (i < world.num_wrong_images) image.cam_from_target = {RandomRotation(&random_), {1, 2, 3}};
    shared_.push_back(image);
  }

  Eigen::Vector3d MovedInDepth(double noise, const Eigen::Vector3d& center,
                               const Eigen::Vector3d& xyz) {
    return xyz + Normal(noise, &random_) * (xyz - center);
  }

  void SpoilPoints(double share, SharedPhoto* image) {
    const size_t num = share * image->points.size();
    for (size_t k = 0; k + 1 < num; ++k) {
      std::swap(image->points[k].target_xyz, image->points[k + 1].target_xyz);
    }
  }

  std::mt19937 random_;
  SyntheticOptions options_;
};

double RotationErrorRad(const Similarity& a, const Similarity& b) {
  return a.rotation.angularDistance(b.rotation);
}

void ExpectTruth(const Scene& scene, const Sim3Result& result, double tolerance) {
  ASSERT_TRUE(result.success) << result.reason;
  EXPECT_NEAR(result.target_from_source.scale / scene.truth_.scale, 1.0, tolerance);
  EXPECT_LT(RotationErrorRad(result.target_from_source, scene.truth_), tolerance);
  const Eigen::Vector3d middle(2, 0, 5);
  const double distance =
      (result.target_from_source.Apply(middle) - scene.truth_.Apply(middle)).norm();
  EXPECT_LT(distance / scene.truth_.scale, 10 * tolerance);
}

TEST(Similarity, InverseUndoes) {
  const Similarity s{2.5, Eigen::Quaterniond(1, 2, 3, 4).normalized(), {1, 2, 3}};
  const Eigen::Vector3d x(4, -5, 6);
  EXPECT_LT((s.Inverse().Apply(s.Apply(x)) - x).norm(), 1e-12);
}

TEST(Similarity, TransformedPoseSeesTransformedPointAtTheSamePixel) {
  const Similarity s{0.3, Eigen::Quaterniond(1, 2, 3, 4).normalized(), {1, 2, 3}};
  const CameraPose pose{Eigen::Quaterniond(1, 0.1, -0.2, 0.3).normalized(), {0.5, 0.6, 7}};
  const Eigen::Vector3d x(0.4, -0.5, 6);
  const Eigen::Vector3d moved = TransformPose(s, pose).Apply(s.Apply(x));
  EXPECT_LT((moved - s.scale * pose.Apply(x)).norm(), 1e-12);
}

TEST(Similarity, FromPointsRefusesLineSpotAndTooFew) {
  const std::vector<Eigen::Vector3d> line = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {5, 5, 5}};
  const std::vector<Eigen::Vector3d> spot(4, Eigen::Vector3d(1, 2, 3));
  const std::vector<Eigen::Vector3d> two = {{0, 0, 0}, {1, 0, 0}};
  EXPECT_FALSE(SimilarityFromPoints(line, line));
  EXPECT_FALSE(SimilarityFromPoints(spot, spot));
  EXPECT_FALSE(SimilarityFromPoints(two, two));
}

TEST(Similarity, FromThreePointsIsExact) {
  const Similarity s{40, Eigen::Quaterniond(1, -2, 3, 4).normalized(), {1, 2, 3}};
  const std::vector<Eigen::Vector3d> source = {{0, 0, 0}, {1, 0, 0}, {0, 2, 1}};
  std::vector<Eigen::Vector3d> target;
  for (const auto& x : source) target.push_back(s.Apply(x));
  const auto found = SimilarityFromPoints(source, target);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->scale, s.scale, 1e-9);
  EXPECT_LT(found->rotation.angularDistance(s.rotation), 1e-7);
}

class ScaleTest : public ::testing::TestWithParam<double> {};

TEST_P(ScaleTest, FindsTruthWithNoiseAndOutliers) {
  World world;
  world.scale = GetParam();
  world.depth_noise = 0.01;
  world.wrong_points = 0.4;
  const Scene scene(world, 7);
  ExpectTruth(scene, EstimateSim3(scene.shared_, {}), 3e-3);
}

INSTANTIATE_TEST_SUITE_P(Scales, ScaleTest, ::testing::Values(0.01, 0.1, 1.0, 10.0, 100.0));

TEST(Sim3, WorksWithCentresOnALine) {
  World world;
  world.path = Path::kForward;
  world.depth_noise = 0.01;
  const Scene scene(world, 3);
  ExpectTruth(scene, EstimateSim3(scene.shared_, {}), 3e-3);
}

TEST(Sim3, WorksWithCentresInOneSpot) {
  World world;
  world.path = Path::kRotation;
  world.scale = 0.2;
  world.depth_noise = 0.01;
  const Scene scene(world, 4);
  ExpectTruth(scene, EstimateSim3(scene.shared_, {}), 3e-3);
}

TEST(Sim3, LeavesOutPhotosWithWrongPoses) {
  World world;
  world.num_images = 10;
  world.num_wrong_images = 6;
  const Scene scene(world, 5);
  const Sim3Result result = EstimateSim3(scene.shared_, {});
  ExpectTruth(scene, result, 1e-3);
  EXPECT_EQ(result.inlier_image_ids, (std::vector<int64_t>{106, 107, 108, 109}));
}

TEST(Sim3, MinimalSetOfThreeIsEnough) {
  World world;
  world.num_images = 3;
  const Scene scene(world, 6);
  ExpectTruth(scene, EstimateSim3(scene.shared_, {}), 1e-3);
}

TEST(Sim3, TwoAreNotEnough) {
  World world;
  world.num_images = 2;
  const Scene scene(world, 6);
  const Sim3Result result = EstimateSim3(scene.shared_, {});
  EXPECT_FALSE(result.success);
  EXPECT_FALSE(result.reason.empty());
}

TEST(Sim3, OnePhotoIsEnoughIfThatIsAskedFor) {
  World world;
  world.num_images = 1;
  world.depth_noise = 0.01;
  const Scene scene(world, 6);
  Sim3Options options;
  options.min_inlier_images = 1;
  ExpectTruth(scene, EstimateSim3(scene.shared_, options), 5e-3);
}

TEST(Sim3, NothingSharedIsNoSuccess) { EXPECT_FALSE(EstimateSim3({}, {}).success); }

TEST(Sim3, ThreePhotosOfWhichOneIsWrongFail) {
  World world;
  world.num_images = 3;
  world.num_wrong_images = 1;
  const Scene scene(world, 8);
  EXPECT_FALSE(EstimateSim3(scene.shared_, {}).success);
}

TEST(Sim3, PhotosThatEachMoveTheirOwnWayFail) {
  World world;
  world.num_wrong_images = 6;
  const Scene scene(world, 9);
  EXPECT_FALSE(EstimateSim3(scene.shared_, {}).success);
}

TEST(Sim3, PointsMatchedToWrongPointsFail) {
  World world;
  world.wrong_points = 1.0;
  const Scene scene(world, 10);
  EXPECT_FALSE(EstimateSim3(scene.shared_, {}).success);
}

TEST(Sim3, PhotosWithFewCommonPointsAreNoEvidence) {
  Scene scene(World(), 11);
  for (size_t i = 2; i < scene.shared_.size(); ++i) scene.shared_[i].points.resize(7);
  EXPECT_FALSE(EstimateSim3(scene.shared_, {}).success);
}

TEST(Sim3, ToleratesDifferentFocalLengths) {
  World world;
  world.target_focal_factor = 1.004;
  const Scene scene(world, 12);
  ExpectTruth(scene, EstimateSim3(scene.shared_, {}), 1e-2);
}

TEST(Sim3, EqualSeedsGiveEqualResults) {
  World world;
  world.num_images = 30;
  world.num_wrong_images = 12;
  world.depth_noise = 0.02;
  const Scene scene(world, 13);
  Sim3Options options;
  options.seed = 42;
  const Sim3Result a = EstimateSim3(scene.shared_, options);
  const Sim3Result b = EstimateSim3(scene.shared_, options);
  ASSERT_TRUE(a.success);
  EXPECT_EQ(a.target_from_source.scale, b.target_from_source.scale);
  EXPECT_EQ(a.target_from_source.translation, b.target_from_source.translation);
  EXPECT_EQ(a.inlier_image_ids, b.inlier_image_ids);
}

TEST(Sim3, GoesOnFromASimilarityThatStillFits) {
  World world;
  world.num_images = 10;
  world.num_wrong_images = 4;
  const Scene scene(world, 14);
  Similarity near = scene.truth_;
  near.scale *= 1.001;
  const Sim3Result result = RefineSim3From(near, scene.shared_, {});
  ExpectTruth(scene, result, 1e-3);
  EXPECT_EQ(result.inlier_image_ids.size(), 6u);
  EXPECT_EQ(result.num_usable_images, 10);
  EXPECT_EQ(result.num_trials, 0);
}

TEST(Sim3, DoesNotGoOnFromASimilarityThatNoPhotoAgreesWith) {
  const Scene scene(World(), 15);
  Similarity far = scene.truth_;
  far.scale *= 2;
  const Sim3Result result = RefineSim3From(far, scene.shared_, {});
  EXPECT_FALSE(result.success);
  EXPECT_FALSE(result.reason.empty());
}

TEST(Sim3, RefusesNonsenseOptions) {
  Sim3Options options;
  options.min_inlier_images = 0;
  EXPECT_THROW(EstimateSim3({}, options), std::invalid_argument);
}

TEST(PairSharedViews, TakesCommonPhotosAndCommonPoints) {
  SharedView a, b, c;
  a.image_id = b.image_id = 5;
  c.image_id = 6;
  for (SharedView* view : {&a, &b, &c}) {
    view->camera.InitializeWithName("SIMPLE_RADIAL", 1000, 800, 600);
  }
  a.observations = {{1, {{1, 1, 1}, {10, 10}}}, {2, {{2, 2, 2}, {20, 20}}}};
  b.observations = {{2, {{4, 4, 4}, {20, 20}}}, {3, {{6, 6, 6}, {30, 30}}}};
  const auto shared = PairSharedViews({a, c}, {b});
  ASSERT_EQ(shared.size(), 1u);
  ASSERT_EQ(shared[0].points.size(), 1u);
  EXPECT_EQ(shared[0].points[0].point2D_idx, 2u);
  EXPECT_EQ(shared[0].points[0].source_xyz.x(), 2);
  EXPECT_EQ(shared[0].points[0].target_xyz.x(), 4);
}

}  // namespace skein::sim3_ransac_test
