#include "bundle/bundle.h"

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include "base/camera_models.h"
#include "base/cost_functions.h"
#include "base/pose.h"
#include "bundle/projection.h"
#include "bundle/reduced_system.h"
#include "mapping/bundle_builder.h"
#include "mapping/synthetic_scene.h"

namespace skein {
namespace {

// The scene at its truth, disturbed by `shift`; the first two poses held.
Bundle MakeBundle(const SyntheticScene& scene, double shift) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, shift);
  Bundle bundle;
  BundleCamera camera;
  camera.camera_id = 1;
  camera.model_id = colmap::SimpleRadialCameraModel::model_id;
  camera.params = {1000, 600, 450, 0};
  bundle.cameras.push_back(camera);
  for (size_t i = 0; i < scene.photos.size(); ++i) {
    BundlePose pose;
    pose.image_id = static_cast<uint32_t>(i + 1);
    pose.R = scene.rotations[i];
    pose.t = scene.translations[i];
    pose.constant = i < 2;
    if (!pose.constant) pose.t += Eigen::Vector3d(noise(random), noise(random), noise(random));
    bundle.poses.push_back(pose);
  }
  std::vector<std::vector<BundleObservation>> of_point(scene.points.size());
  for (size_t i = 0; i < scene.photos.size(); ++i) {
    for (size_t k = 0; k < scene.visible[i].size(); ++k) {
      const Keypoint& keypoint = scene.photos[i].keypoints[k];
      of_point[scene.visible[i][k]].push_back(
          {static_cast<int>(i), static_cast<uint32_t>(k), {keypoint.x, keypoint.y}});
    }
  }
  for (size_t p = 0; p < of_point.size(); ++p) {
    if (of_point[p].size() < 2) continue;
    BundlePoint point;
    point.point3D_id = p;
    point.xyz = scene.points[p] + Eigen::Vector3d(noise(random), noise(random), noise(random));
    point.first = static_cast<int>(bundle.observations.size());
    point.count = static_cast<int>(of_point[p].size());
    bundle.points.push_back(point);
    bundle.observations.insert(bundle.observations.end(), of_point[p].begin(), of_point[p].end());
  }
  return bundle;
}

double MaxCenterError(const SyntheticScene& scene, const Bundle& bundle) {
  double error = 0;
  for (size_t i = 0; i < bundle.poses.size(); ++i) {
    const Eigen::Vector3d center = -(bundle.poses[i].R.transpose() * bundle.poses[i].t);
    error = std::max(error, (center - scene.Center(i)).norm());
  }
  return error;
}

TEST(Projection, JacobiansAgreeWithDifferencesForAllModels) {
  for (const std::string name :
       {"SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "OPENCV_FISHEYE",
        "FULL_OPENCV", "FOV", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE", "THIN_PRISM_FISHEYE"}) {
    const int id = colmap::CameraModelNameToId(name);
    std::vector<double> params = colmap::CameraModelInitializeParams(id, 900, 1200, 900);
    for (const size_t i : colmap::CameraModelExtraParamsIdxs(id)) params[i] = 0.05;
    const Eigen::Vector3d point(0.3, -0.2, 1.5);
    Eigen::Vector2d pixel, moved;
    Eigen::Matrix<double, 2, 3> J;
    IntrinsicsJacobian J_params;
    ASSERT_TRUE(ProjectWithJacobians(id, params, point, &pixel, &J, &J_params));
    for (int i = 0; i < 3; ++i) {
      Eigen::Vector3d shifted = point;
      shifted[i] += 1e-7;
      ASSERT_TRUE(Project(id, params, shifted, &moved));
      EXPECT_LT(((moved - pixel) / 1e-7 - J.col(i)).norm(), 1e-2) << name;
    }
    for (size_t i = 0; i < params.size(); ++i) {
      std::vector<double> shifted = params;
      shifted[i] += 1e-7;
      ASSERT_TRUE(Project(id, shifted, point, &moved));
      EXPECT_LT(((moved - pixel) / 1e-7 - J_params.col(i)).norm(), 1e-2) << name;
    }
  }
}

TEST(Projection, FailsBehindTheCamera) {
  Eigen::Vector2d pixel;
  EXPECT_FALSE(
      Project(colmap::SimpleRadialCameraModel::model_id, {1000, 600, 450, 0}, {0, 0, -1}, &pixel));
}

TEST(Bundle, ConvergesToTheTruthWithoutNoise) {
  SyntheticOptions options;
  options.noise_px = 0;
  const SyntheticScene scene = MakeScene(options);
  Bundle bundle = MakeBundle(scene, 0.05);
  BundleOptions solve;
  solve.function_tolerance = 1e-12;
  const BundleSummary summary = SolveBundle(solve, &bundle);
  ASSERT_TRUE(summary.usable);
  EXPECT_LT(summary.final_cost, 1e-3);  // keypoints are floats
  EXPECT_LT(MaxCenterError(scene, bundle), 1e-4);
}

// A walk, where a photo shares points with the next ones, and a place that all photos see.
TEST(Bundle, SparseCholeskyIsForPhotosThatShareFewPoints) {
  constexpr int kNumPoses = 400;
  PosePattern walk(kNumPoses), place(kNumPoses);
  for (int i = 0; i < kNumPoses; ++i) {
    for (int j = i; j < kNumPoses; ++j) {
      if (j < i + 20) walk[i].push_back(j);
      place[i].push_back(j);
    }
  }
  EXPECT_TRUE(IsFasterSparse(walk));
  EXPECT_FALSE(IsFasterSparse(place));
}

TEST(Bundle, SparseAndThreadedSolutionsAreTheDenseOne) {
  const SyntheticScene scene = MakeScene({});
  Bundle dense = MakeBundle(scene, 0.05);
  dense.cameras[0].refined = {0, 3};
  Bundle sparse = dense, threaded = dense;
  BundleOptions solve;
  solve.function_tolerance = 1e-10;
  const double cost = SolveBundle(solve, &dense).final_cost;
  solve.max_dense_poses = solve.max_filled_poses = 0;
  EXPECT_NEAR(SolveBundle(solve, &sparse).final_cost, cost, 1e-6 * cost);
  solve.num_threads = 3;
  EXPECT_NEAR(SolveBundle(solve, &threaded).final_cost, cost, 1e-6 * cost);
  for (size_t i = 0; i < dense.poses.size(); ++i) {
    EXPECT_LT((dense.poses[i].t - sparse.poses[i].t).norm(), 1e-4);
  }
}

// The same problem with Ceres and COLMAP's residuals; refines all of the one camera but its centre.
class CeresBundle {
 public:
  explicit CeresBundle(const Bundle& bundle) : bundle_(bundle) {
    for (const BundlePose& pose : bundle.poses) {
      qvecs_.push_back(colmap::RotationMatrixToQuaternion(pose.R));
      tvecs_.push_back(pose.t);
    }
    for (const BundlePoint& point : bundle.points) points_.push_back(point.xyz);
    params = bundle.cameras[0].params;
  }

  double Solve() {
    using Model = colmap::SimpleRadialCameraModel;
    ceres::Problem problem;
    for (size_t p = 0; p < points_.size(); ++p) {
      const BundlePoint& point = bundle_.points[p];
      for (int i = point.first; i < point.first + point.count; ++i) {
        const BundleObservation& o = bundle_.observations[i];
        problem.AddResidualBlock(colmap::BundleAdjustmentCostFunction<Model>::Create(o.pixel),
                                 new ceres::SoftLOneLoss(1.0), qvecs_[o.pose].data(),
                                 tvecs_[o.pose].data(), points_[p].data(), params.data());
      }
    }
    for (size_t i = 0; i < qvecs_.size(); ++i) {
      problem.SetManifold(qvecs_[i].data(), new ceres::QuaternionManifold);
      if (!bundle_.poses[i].constant) continue;
      problem.SetParameterBlockConstant(qvecs_[i].data());
      problem.SetParameterBlockConstant(tvecs_[i].data());
    }
    problem.SetManifold(params.data(), new ceres::SubsetManifold(4, {1, 2}));
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.max_num_iterations = 200;
    options.function_tolerance = options.parameter_tolerance = options.gradient_tolerance = 1e-12;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    return summary.final_cost;
  }

  Eigen::Vector3d Center(size_t pose) const {
    return colmap::ProjectionCenterFromPose(qvecs_[pose], tvecs_[pose]);
  }
  std::vector<double> params;

 private:
  const Bundle& bundle_;
  std::vector<Eigen::Vector4d> qvecs_;
  std::vector<Eigen::Vector3d> tvecs_, points_;
};

TEST(Bundle, ReachesTheMinimumThatCeresReaches) {
  SyntheticOptions options;
  options.noise_px = 1;
  options.distortion = -0.1;
  const SyntheticScene scene = MakeScene(options);
  Bundle ours = MakeBundle(scene, 0.05);
  ours.cameras[0].params[0] *= 1.1;
  ours.cameras[0].refined = {0, 3};
  CeresBundle ceres_bundle(ours);
  BundleOptions solve;
  solve.function_tolerance = 1e-14;
  solve.max_iterations = 200;
  const double theirs = ceres_bundle.Solve();
  const BundleSummary summary = SolveBundle(solve, &ours);
  ASSERT_TRUE(summary.usable);
  EXPECT_GT(theirs, 100);
  EXPECT_NEAR(summary.final_cost, theirs, 1e-6 * theirs);
  EXPECT_NEAR(ours.cameras[0].params[0], ceres_bundle.params[0], 0.01);
  EXPECT_NEAR(ours.cameras[0].params[3], ceres_bundle.params[3], 1e-5);
  for (size_t i = 0; i < ours.poses.size(); ++i) {
    const Eigen::Vector3d center = -(ours.poses[i].R.transpose() * ours.poses[i].t);
    EXPECT_LT((center - ceres_bundle.Center(i)).norm(), 1e-4) << i;
  }
}

TEST(Bundle, ConsistentWeightsHoldWhatIsFarAndFreeWhatIsNear) {
  const SyntheticScene scene = MakeScene({});
  double moved[2] = {0, 0};
  for (int far = 0; far < 2; ++far) {
    Bundle bundle = MakeBundle(scene, 0);
    bundle.poses[5].t.x() += 0.05;
    bundle.poses[5].weight = far ? 1e-4 : 1.0;
    const Eigen::Vector3d before = bundle.poses[5].t;
    BundleOptions solve;
    solve.weight_form = WeightForm::kConsistent;
    ASSERT_TRUE(SolveBundle(solve, &bundle).usable);
    moved[far] = (bundle.poses[5].t - before).norm();
  }
  EXPECT_GT(moved[0], 0.04);
  EXPECT_LT(moved[1], 0.1 * moved[0]);
}

TEST(Bundle, CancelLeavesItAsItWas) {
  const SyntheticScene scene = MakeScene({});
  Bundle bundle = MakeBundle(scene, 0.05);
  const Eigen::Vector3d before = bundle.poses[4].t;
  std::atomic<bool> cancel{true};
  BundleOptions solve;
  solve.cancel = &cancel;
  EXPECT_FALSE(SolveBundle(solve, &bundle).usable);
  EXPECT_EQ(bundle.poses[4].t, before);
}

TEST(Bundle, RefusesIndicesOutOfRange) {
  Bundle bundle = MakeBundle(MakeScene({}), 0);
  bundle.observations[3].pose = 99;
  EXPECT_THROW(SolveBundle({}, &bundle), std::invalid_argument);
}

TEST(Bundle, ObservationsBeyondAHundredAnImageDontOutweighACamerasPrior) {
  for (const int num_observations : {200, 200 * 16}) {
    Bundle bundle;
    bundle.poses.resize(2);
    bundle.cameras.resize(1);
    bundle.cameras[0].params = bundle.cameras[0].prior = {1000, 600, 450, 0};
    bundle.cameras[0].prior_sigma = {100, 0, 0, 0.1};
    for (int i = 0; i < num_observations; ++i)
      bundle.observations.push_back({i % 2, 0, Eigen::Vector2d::Zero()});
    ScalePriors(&bundle);
    const double factor = num_observations == 200 ? 1 : 4;
    EXPECT_DOUBLE_EQ(bundle.cameras[0].prior_sigma[0], 100 / factor);
    EXPECT_DOUBLE_EQ(bundle.cameras[0].prior_sigma[1], 0);
    EXPECT_DOUBLE_EQ(bundle.cameras[0].prior_sigma[3], 0.1 / factor);
  }
}

class BuildBundleTest : public testing::Test {
 protected:
  void SetUp() override {
    AddToMap(scene_, scene_.pairs, &map_);
    RegisterAtTruth(scene_, map_.photos(), Eigen::Vector3d::Zero(), &map_);
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

}  // namespace
}  // namespace skein
