#include "mapping/registration.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "map/filters.h"
#include "map/image_pose.h"
#include "sfm/projection.h"
#include "testing/submap_rig.h"
#include "testing/synthetic_scene.h"
#include "testing/test_random.h"

namespace skein::registration_test {

Eigen::Matrix3d TurnedBy(double degrees) {
  return Eigen::AngleAxisd(degrees * M_PI / 180, Eigen::Vector3d::UnitX()).toRotationMatrix();
}

// A small tilted plane far away: tilted the other way it looks nearly the same. Photo 1 is of the
// right pose. Beside the plane are a few points, of which photo 1 has what the wrong pose sees.
class TwoPoses : public testing::Test {
 protected:
  static constexpr size_t kNumInPlane = 100, kNumMismatches = 5;

  void SetUp() override {
    for (size_t i = 0; i < kNumInPlane; ++i) {
      const double x = Uniform(-0.5, 0.5, &random_);
      scene_.points.emplace_back(x, Uniform(-0.5, 0.5, &random_), 0);
    }
    for (size_t i = 0; i < kNumMismatches; ++i) {
      scene_.points.emplace_back(0.1 * i, 0.05 * i, 1.0 + 0.1 * i);
    }
    for (const Eigen::Matrix3d& R : {right_, wrong_}) {
      scene_.AddPose(R, R.transpose() * Eigen::Vector3d(0, 0, -10));
    }
    SyntheticOptions options;
    options.noise_px = 0.1;
    Photograph(options, &random_, &scene_);
    ASSERT_TRUE(map_.AddPhoto(scene_.photos[0]).ok());
    map_.SetCameraRefined(1, true);
    for (size_t p = 0; p < scene_.points.size(); ++p) See(p, p < kNumInPlane ? 0 : 1);
  }

  // A point, and where a photo sees it: each sees all.
  void See(size_t point, size_t photo) {
    const Keypoint& keypoint = scene_.photos[photo].keypoints.at(point);
    visible_.point2D_idxs.push_back(static_cast<Point2DIdx>(point));
    visible_.point3D_ids.push_back(point + 1);
    visible_.pixels.emplace_back(keypoint.x, keypoint.y);
    visible_.xyz.push_back(scene_.points[point]);
  }

  // Visible points that the pose of a photo projects within 12 px.
  int NumWithinWidestLimit(size_t photo) const {
    const Camera& camera = map_.reconstruction().Camera(1);
    int num = 0;
    for (size_t i = 0; i < visible_.size(); ++i) {
      Eigen::Vector2d pixel;
      num +=
          Project(camera.ModelId(), camera.Params(),
                  scene_.rotations[photo] * visible_.xyz[i] + scene_.translations[photo], &pixel) &&
          (pixel - visible_.pixels[i]).norm() <= limits::kMaxPoseErrorPx;
    }
    return num;
  }

  double RotationErrorDeg(const PoseEstimate& estimate) const {
    return Eigen::AngleAxisd(estimate.pose.R * right_.transpose()).angle() * 180 / M_PI;
  }

  const Eigen::Matrix3d right_ = TurnedBy(40), wrong_ = TurnedBy(-40);
  std::mt19937 random_{1};
  SyntheticScene scene_;
  SceneMap map_;
  VisiblePoints visible_;
};

// A few mismatches beside the plane agree with the wrong pose, the plane's points do within 12 px.
TEST_F(TwoPoses, TheOneWithTheSmallerErrorsIsTakenNotTheOneWithMoreInliers) {
  ASSERT_GT(NumWithinWidestLimit(1), NumWithinWidestLimit(0)) << "no trap";
  const PoseEstimate estimate = EstimatePose(map_, 1, visible_);
  ASSERT_TRUE(estimate.ok) << estimate.refusal.text;
  EXPECT_LT(RotationErrorDeg(estimate), 1);
  EXPECT_EQ(estimate.num_inliers, 100);
}

// The last photo has settled for too short a focal length, nearer to the scene: some of its points
// fit, the others are not observed. The `num_of_camera` last photos have one camera.
SceneMap WithWrongFocal(int num_of_camera, bool focal_from_exif) {
  constexpr double kFactor = 0.9;
  SyntheticOptions options;
  options.focal_from_exif = focal_from_exif;
  options.second_camera_from = options.num_photos - num_of_camera + 1;
  SceneMap map;
  FillMap(MakeScene(options), &map);
  const ImageId id = options.num_photos;
  const Image& image = map.reconstruction().Image(id);
  BundlePose pose;
  GetPose(image, &pose);
  std::vector<double> depths;
  for (const Point3DId point : PointsSeenBy(map, {id})) {
    depths.push_back((pose.R * map.reconstruction().Point3D(point).XYZ() + pose.t).z());
  }
  std::nth_element(depths.begin(), depths.begin() + depths.size() / 2, depths.end());
  pose.t.z() -= (1 - kFactor) * depths[depths.size() / 2];
  map.SetPose(pose);
  std::vector<double> params = map.reconstruction().Camera(image.CameraId()).Params();
  params[0] *= kFactor;
  map.SetCamera(image.CameraId(), params);

  FilterPoints(AllPoints(map), &map);
  return map;
}

// A photo of the 60 of `skein sim --scenario courtyard --agents 2 --photos 30 --size 960x720` stood
// 1.4 m off before a facade, the points around it in place, and stayed there.
TEST(HasBetterPose, WhereAPhotoStandsInAnotherPlaceThanItsPointsSay) {
  SubmapRig run(SyntheticOptions{});
  run.FeedAll();
  SceneMap& map = run.map.map();
  for (const ImageId id : map.reconstruction().RegImageIds()) EXPECT_FALSE(HasBetterPose(map, id));
  const Image& image = map.reconstruction().Image(5);
  map.SetPose(5, image.Qvec(), image.Tvec() + Eigen::Vector3d(0.6, 0, 0.2));
  EXPECT_TRUE(HasBetterPose(map, 5));
  EXPECT_FALSE(HasBetterPose(map, 4));
}

class FitsElsewhere : public testing::TestWithParam<bool> {};

TEST_P(FitsElsewhere, WithIntrinsicsOfItsOwnAPhotoThatLacksSomePointsIsEstimatedAnew) {
  const SceneMap map = WithWrongFocal(1, GetParam());
  const VisiblePoints visible = FindVisiblePoints(map, 8);
  const double share =
      static_cast<double>(map.reconstruction().Image(8).NumPoints3D()) / visible.size();
  ASSERT_GT(share, 0.5);
  ASSERT_LT(share, 0.85);
  EXPECT_TRUE(::skein::FitsElsewhere(map, 8, visible));
  const PoseEstimate anew = EstimatePose(map, 8, visible);
  EXPECT_NEAR(anew.camera_params[0], 1000, 10);
}

TEST_P(FitsElsewhere, IntrinsicsThatAnotherPhotoHasTooStay) {
  const SceneMap map = WithWrongFocal(2, GetParam());
  EXPECT_FALSE(::skein::FitsElsewhere(map, 8, FindVisiblePoints(map, 8)));
}

INSTANTIATE_TEST_SUITE_P(FocalFromExif, FitsElsewhere, testing::Bool());

// As of a photo that was cropped and enlarged.
TEST(EstimatePose, AFocalLengthFromExifThatDoesNotFitIsSearched) {
  SyntheticOptions options;
  options.second_camera_from = options.num_photos;
  options.shape = SyntheticOptions::Shape::kWall;
  SyntheticScene scene = MakeScene(options);
  scene.photos.back().focal_px *= 0.5;
  SceneMap map;
  FillMap(scene, &map);
  map.Deregister(8);
  const PoseEstimate estimate = EstimatePose(map, 8, FindVisiblePoints(map, 8));
  ASSERT_TRUE(estimate.ok) << estimate.refusal.text;
  EXPECT_NEAR(estimate.camera_params[0], 1000, 10);
}

// A free pose and a held one, 2 units apart, that see the same points.
Bundle TwoViews(bool constant_points) {
  SyntheticOptions options;
  options.num_photos = 2;
  options.num_points = 50;
  options.step_deg = 14.4;
  options.noise_px = 0;
  Bundle bundle = BundleAtTruth(options, MakeScene(options));
  bundle.poses[1].constant = true;
  for (BundlePoint& point : bundle.points) point.constant = constant_points;
  return bundle;
}

TEST(PoseSigmas, CertainPointsAllAroundDetermineAPose) {
  const PoseSigmas sigmas = SigmasOfFirstPose(TwoViews(true));
  EXPECT_GT(sigmas.position, 0);
  EXPECT_LT(sigmas.position, 0.005);
}

// Matches between two photos say nothing of how far they are apart.
TEST(PoseSigmas, PointsTriangulatedWithOneOtherPhotoLeaveTheDistanceOpen) {
  EXPECT_GT(SigmasOfFirstPose(TwoViews(false)).position, 100);
}

TEST(PoseSigmas, OneCertainPointAmongThemClosesIt) {
  Bundle bundle = TwoViews(false);
  bundle.points[0].constant = true;
  EXPECT_LT(SigmasOfFirstPose(bundle).position, 0.02);
}

}  // namespace skein::registration_test
