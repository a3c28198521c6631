#include "bundle/bundle.h"

#include <gtest/gtest.h>

#include "bundle/bundle_terms.h"
#include "bundle/reduced_system.h"
#include "sfm/camera.h"
#include "sfm/projection.h"
#include "testing/ceres_bundle.h"
#include "testing/synthetic_scene.h"
#include "testing/test_random.h"

namespace skein::bundle_test {

// The scene at its truth, disturbed by `shift`; the first two poses held.
Bundle MakeBundle(const SyntheticScene& scene, double shift) {
  std::mt19937 random(7);
  Bundle bundle = BundleAtTruth({}, scene);
  for (size_t i = 0; i < bundle.poses.size(); ++i) {
    bundle.poses[i].constant = i < 2;
    if (i >= 2) bundle.poses[i].t += Normal3(shift, &random);
  }
  for (BundlePoint& point : bundle.points) point.xyz += Normal3(shift, &random);
  return bundle;
}

Eigen::Vector3d CenterOf(const BundlePose& pose) { return -(pose.R.transpose() * pose.t); }

double MaxCenterError(const SyntheticScene& scene, const Bundle& bundle) {
  double error = 0;
  for (size_t i = 0; i < bundle.poses.size(); ++i) {
    error = std::max(error, (CenterOf(bundle.poses[i]) - scene.Center(i)).norm());
  }
  return error;
}

// Central differences: pixels for a step of 2 h in the i-th of `values`.
template <class Function>
Eigen::Vector2d Difference(const Function& project, double* value) {
  constexpr double kStep = 1e-5;
  const double at = *value;
  *value = at + kStep;
  const Eigen::Vector2d ahead = project();
  *value = at - kStep;
  const Eigen::Vector2d behind = project();
  *value = at;
  return (ahead - behind) / (2 * kStep);
}

TEST(Projection, DerivativesAreCentralDifferencesForEveryCameraModel) {
  for (const std::string name :
       {"SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "OPENCV_FISHEYE",
        "FULL_OPENCV", "FOV", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE", "THIN_PRISM_FISHEYE"}) {
    const int id = CameraModelId(name);
    std::vector<double> params = InitialCameraParams(id, 900, 1200, 900);
    for (const size_t i : CameraModelExtraParamsIdxs(id)) params[i] = 0.05;
    Eigen::Vector3d point(0.3, -0.2, 1.5);
    Eigen::Vector2d pixel;
    Eigen::Matrix<double, 2, 3> J;
    IntrinsicsJacobian J_params;
    ASSERT_TRUE(ProjectWithJacobians(id, params, point, &pixel, &J, &J_params));
    const auto project = [&] {
      Eigen::Vector2d projected;
      EXPECT_TRUE(Project(id, params, point, &projected));
      return projected;
    };
    EXPECT_LT((project() - pixel).norm(), 1e-9) << name;
    for (int i = 0; i < 3; ++i) {
      EXPECT_LT((Difference(project, &point[i]) - J.col(i)).norm(), 1e-4) << name;
    }
    for (size_t i = 0; i < params.size(); ++i) {
      EXPECT_LT((Difference(project, &params[i]) - J_params.col(i)).norm(), 1e-4) << name;
    }
  }
}

TEST(Projection, FailsBehindTheCamera) {
  Eigen::Vector2d pixel;
  EXPECT_FALSE(Project(kSimpleRadial, {1000, 600, 450, 0}, {0, 0, -1}, &pixel));
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

TEST(Bundle, StopsBetweenStepsWithWhatItHasComeTo) {
  const SyntheticScene scene = MakeScene({});
  Bundle whole = MakeBundle(scene, 0.05), bundle = whole;
  const BundleSummary to_the_end = SolveBundle({}, &whole);
  ASSERT_GT(to_the_end.iterations, 2);
  int num_asked = 0;
  BundleOptions solve;
  solve.stop = [&num_asked] { return ++num_asked == 2; };
  const BundleSummary stopped = SolveBundle(solve, &bundle);
  ASSERT_TRUE(stopped.usable);
  EXPECT_EQ(stopped.iterations, 2);
  EXPECT_LT(stopped.final_cost, stopped.initial_cost);
  EXPECT_GT(stopped.final_cost, to_the_end.final_cost);
  EXPECT_EQ(SolveBundle({}, &bundle).initial_cost, stopped.final_cost) << "of the bundle as it is";
}

TEST(Bundle, TakesOneStepWhereItIsToStopFromTheStart) {
  Bundle bundle = MakeBundle(MakeScene({}), 0.05);
  BundleOptions solve;
  solve.stop = [] { return true; };
  const BundleSummary summary = SolveBundle(solve, &bundle);
  ASSERT_TRUE(summary.usable);
  EXPECT_EQ(summary.iterations, 1);
  EXPECT_LT(summary.final_cost, summary.initial_cost);
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

TEST(Bundle, SparseSolutionIsTheDenseOne) {
  const SyntheticScene scene = MakeScene({});
  Bundle dense = MakeBundle(scene, 0.05);
  dense.cameras[0].refined = {0, 3};
  Bundle sparse = dense;
  BundleOptions solve;
  solve.function_tolerance = 1e-10;
  const double cost = SolveBundle(solve, &dense).final_cost;
  solve.is_always_sparse = true;
  EXPECT_NEAR(SolveBundle(solve, &sparse).final_cost, cost, 1e-6 * cost);
  for (size_t i = 0; i < dense.poses.size(); ++i) {
    EXPECT_LT((dense.poses[i].t - sparse.poses[i].t).norm(), 1e-4);
  }
}

TEST(Bundle, ResultDoesNotDependOnTheNumberOfThreads) {
  Bundle start = MakeBundle(MakeScene({}), 0.05);
  start.cameras[0].refined = {0, 3};
  Bundle alone = start;
  BundleOptions solve;
  solve.loss = Loss::kSoftL1;
  const double cost = SolveBundle(solve, &alone).final_cost;
  for (const int num_threads : {2, 3, 8}) {
    Bundle bundle = start;
    solve.num_threads = num_threads;
    EXPECT_EQ(SolveBundle(solve, &bundle).final_cost, cost);
    for (size_t i = 0; i < bundle.poses.size(); ++i) {
      EXPECT_EQ(bundle.poses[i].R, alone.poses[i].R);
      EXPECT_EQ(bundle.poses[i].t, alone.poses[i].t);
    }
    EXPECT_EQ(bundle.cameras[0].params, alone.cameras[0].params);
  }
}

// 60 photos that all see the same: the matrix costs more than products with it.
SyntheticOptions LongTracks() {
  SyntheticOptions options;
  options.num_photos = 60;
  options.step_deg = 1;
  return options;
}

TEST(Bundle, AnEarlierFactorSparesTheDecompositionAndChangesNothing) {
  const SyntheticScene scene = MakeScene(LongTracks());
  BundleOptions solve;
  solve.function_tolerance = 1e-10;
  Bundle first = MakeBundle(scene, 0.02), second = MakeBundle(scene, 0.03), direct = second;
  const BundleSummary of_first = SolveBundle(solve, &first);
  ASSERT_NE(of_first.factor, nullptr);
  EXPECT_EQ(of_first.num_decompositions, 1);
  EXPECT_GT(of_first.iterations, 1);
  const BundleSummary of_direct = SolveBundle(solve, &direct);
  solve.factor = of_first.factor;
  const BundleSummary of_second = SolveBundle(solve, &second);
  EXPECT_EQ(of_second.num_decompositions, 0);
  EXPECT_NEAR(of_second.final_cost, of_direct.final_cost, 1e-7 * of_direct.final_cost);
  EXPECT_NEAR(MaxCenterError(scene, second), MaxCenterError(scene, direct), 1e-5);
}

TEST(Bundle, AFactorServesBundlesWithOtherPosesCamerasAndThreads) {
  const SyntheticScene scene = MakeScene(LongTracks());
  BundleOptions solve;
  solve.function_tolerance = 1e-10;
  Bundle before = MakeBundle(scene, 0.02);
  for (int i = 50; i < 60; ++i) before.poses[i].constant = true;
  solve.factor = SolveBundle(solve, &before).factor;
  ASSERT_NE(solve.factor, nullptr);
  Bundle with = MakeBundle(scene, 0.02);
  with.poses[10].constant = true;
  with.cameras[0].refined = {0, 3};
  Bundle without = with;
  solve.num_threads = 2;
  const BundleSummary summary = SolveBundle(solve, &with);
  solve.factor = nullptr;
  const BundleSummary reference = SolveBundle(solve, &without);
  EXPECT_NEAR(summary.final_cost, reference.final_cost, 1e-7 * reference.final_cost);
  EXPECT_NEAR(with.cameras[0].params[0], without.cameras[0].params[0], 1e-2);
}

// The points of outliers go on for long, and move no camera.
TEST(Bundle, EndsWhereTheCamerasAreAtRest) {
  SyntheticOptions options;
  options.noise_px = 0.5;
  Bundle start = MakeBundle(MakeScene(options), 0.02);
  for (size_t i = 0; i < start.observations.size(); i += 10) start.observations[i].pixel.x() += 8;
  Bundle ends = start, goes_on = start;
  BundleOptions solve;
  const BundleSummary of_end = SolveBundle(solve, &ends);
  solve.camera_tolerance = 0;
  const BundleSummary of_minimum = SolveBundle(solve, &goes_on);
  EXPECT_LT(of_end.iterations, of_minimum.iterations);
  EXPECT_LT(of_end.final_cost, 1.02 * of_minimum.final_cost);
  for (size_t i = 0; i < ends.poses.size(); ++i) {
    EXPECT_LT((ends.poses[i].t - goes_on.poses[i].t).norm(), 1e-3) << i;
  }
}

TEST(Bundle, KeepsNoFactorOfShortTracks) {
  Bundle bundle = MakeBundle(MakeScene(SyntheticOptions()), 0.02);
  EXPECT_EQ(SolveBundle(BundleOptions(), &bundle).factor, nullptr);
}

// To the minimum.
CeresSummary ByCeres(Bundle* bundle) {
  CeresOptions options;
  options.max_iterations = 200;
  options.function_tolerance = options.parameter_tolerance = options.gradient_tolerance = 1e-12;
  return SolveByCeres(options, bundle);
}

BundleOptions ToTheMinimum() {
  BundleOptions options;
  options.function_tolerance = 1e-14;
  options.camera_tolerance = 0;
  options.max_iterations = 200;
  return options;
}

TEST(Bundle, ReachesTheMinimumThatCeresReaches) {
  SyntheticOptions options;
  options.noise_px = 1;
  options.camera.distortion = -0.1;
  const SyntheticScene scene = MakeScene(options);
  Bundle ours = MakeBundle(scene, 0.05);
  ours.cameras[0].params[0] *= 1.1;
  ours.cameras[0].refined = {0, 3};
  Bundle theirs = ours;
  const CeresSummary by_ceres = ByCeres(&theirs);
  const BundleSummary summary = SolveBundle(ToTheMinimum(), &ours);
  ASSERT_TRUE(summary.usable && by_ceres.usable);
  EXPECT_GT(by_ceres.final_cost, 100);
  EXPECT_NEAR(summary.final_cost, by_ceres.final_cost, 1e-6 * by_ceres.final_cost);
  EXPECT_NEAR(ours.cameras[0].params[0], theirs.cameras[0].params[0], 0.01);
  EXPECT_NEAR(ours.cameras[0].params[3], theirs.cameras[0].params[3], 1e-5);
  for (size_t i = 0; i < ours.poses.size(); ++i) {
    EXPECT_LT((CenterOf(ours.poses[i]) - CenterOf(theirs.poses[i])).norm(), 1e-4) << i;
  }
}

// Nothing is held but by Ceres, and the priors are off by 5 %.
TEST(Bundle, ReachesTheMinimumThatCeresReachesWithEachCameraModelAndPriors) {
  const SyntheticScene scene = MakeScene({});
  for (const std::string name :
       {"SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV"}) {
    Bundle ours = MakeBundle(scene, 0.02);
    for (BundlePose& pose : ours.poses) pose.constant = false;
    const int id = CameraModelId(name);
    BundleCamera& camera = ours.cameras[0];
    camera.model_id = id;
    camera.params = camera.prior = InitialCameraParams(id, 1050, 1200, 900);
    camera.prior_sigma.assign(camera.params.size(), 0);
    for (const size_t i : CameraModelFocalLengthIdxs(id)) camera.prior_sigma[i] = 50;
    for (const size_t i : CameraModelExtraParamsIdxs(id)) camera.prior_sigma[i] = 0.1;
    for (size_t i = 0; i < camera.params.size(); ++i) {
      if (camera.prior_sigma[i] > 0) camera.refined.push_back(static_cast<int>(i));
    }
    Bundle theirs = ours;
    const CeresSummary by_ceres = ByCeres(&theirs);
    const BundleSummary summary = SolveBundle(ToTheMinimum(), &ours);
    ASSERT_TRUE(summary.usable && by_ceres.usable) << name;
    EXPECT_NEAR(summary.final_cost, by_ceres.final_cost, 1e-5 * by_ceres.final_cost) << name;
  }
}

TEST(Bundle, RigidityHoldsWhatIsFarAndFreeWhatIsNear) {
  const SyntheticScene scene = MakeScene({});
  double moved[2] = {0, 0};
  for (int far = 0; far < 2; ++far) {
    Bundle bundle = MakeBundle(scene, 0);
    bundle.poses[5].t.x() += 0.05;
    bundle.poses[5].stiffness.rigidity = far ? 1e4 - 1 : 0;
    const Eigen::Vector3d before = bundle.poses[5].t;
    BundleOptions solve;
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

TEST(Bundle, HeldPosesAndConstantPointsStayExactly) {
  Bundle bundle = MakeBundle(MakeScene({}), 0.05);
  for (size_t p = 0; p < bundle.points.size(); p += 3) bundle.points[p].constant = true;
  const Bundle before = bundle;
  ASSERT_TRUE(SolveBundle({}, &bundle).usable);
  for (size_t i = 0; i < bundle.poses.size(); ++i) {
    EXPECT_EQ(bundle.poses[i].R == before.poses[i].R, i < 2) << i;
    EXPECT_EQ(bundle.poses[i].t == before.poses[i].t, i < 2) << i;
  }
  for (size_t p = 0; p < bundle.points.size(); ++p) {
    EXPECT_EQ(bundle.points[p].xyz == before.points[p].xyz, p % 3 == 0) << p;
  }
  EXPECT_EQ(bundle.cameras[0].params, before.cameras[0].params);
}

// X' = A X + b for all points, and poses that see the same.
Bundle Moved(Bundle bundle, const Eigen::Matrix3d& A, const Eigen::Vector3d& b) {
  for (BundlePoint& point : bundle.points) point.xyz = A * point.xyz + b;
  for (BundlePose& pose : bundle.poses) {
    pose.R = pose.R * A.transpose();
    pose.t = pose.t - pose.R * b;
  }
  return bundle;
}

TEST(Bundle, TheSolutionDoesNotDependOnTheFrameOfTheWorld) {
  Bundle bundle = MakeBundle(MakeScene({}), 0.05);
  const Eigen::Matrix3d A =
      Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, -2, 0.5).normalized()).matrix();
  const Eigen::Vector3d b(3, -7, 2);
  Bundle moved = Moved(bundle, A, b);
  BundleOptions solve;
  solve.function_tolerance = 1e-10;
  const double cost = SolveBundle(solve, &bundle).final_cost;
  EXPECT_NEAR(SolveBundle(solve, &moved).final_cost, cost, 1e-6 * cost);
  for (size_t p = 0; p < bundle.points.size(); ++p) {
    EXPECT_LT((A * bundle.points[p].xyz + b - moved.points[p].xyz).norm(), 1e-3) << p;
  }
}

// Nothing is held: the cost doesn't change along the gauge, and the damping alone keeps the
// normal equations regular.
TEST(Bundle, SolvesWithAFreeGauge) {
  Bundle bundle = MakeBundle(MakeScene({}), 0.05);
  Bundle held = bundle;
  for (BundlePose& pose : bundle.poses) pose.constant = false;
  BundleOptions solve;
  solve.function_tolerance = 1e-10;
  solve.max_iterations = 100;
  const BundleSummary summary = SolveBundle(solve, &bundle);
  ASSERT_TRUE(summary.usable);
  // More parameters explain no less.
  EXPECT_LE(summary.final_cost, SolveBundle(solve, &held).final_cost * (1 + 1e-6));
}

TEST(Bundle, AnIncrementLeadsFromOnePoseToTheOther) {
  BundlePose from;
  from.R = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).matrix();
  from.t = {1, 2, 3};
  Eigen::Matrix<double, 6, 1> delta;
  delta << 0.1, -0.2, 0.05, 1, -2, 0.5;
  BundlePose to = from;
  IncrementPose(delta, &to);
  EXPECT_LT((PoseIncrement(from, to) - delta).norm(), 1e-9);
}

TEST(RobustLoss, DerivativesAreDifferencesAndSmallResidualsCountSquared) {
  constexpr double kStep = 1e-6;
  for (const Loss kind : {Loss::kSquared, Loss::kSoftL1, Loss::kCauchy}) {
    const RobustLoss loss{kind, 1.5};
    for (const double s : {0.01, 1.0, 40.0}) {
      const double difference = (loss.Value(s + kStep) - loss.Value(s - kStep)) / (2 * kStep);
      EXPECT_NEAR(loss.Derivative(s), difference, 1e-6);
    }
    EXPECT_NEAR(loss.Value(1e-6), 1e-6, 1e-11);
  }
}

TEST(Bundle, ARobustLossKeepsOutliersFromThePoses) {
  SyntheticOptions options;
  options.noise_px = 0;
  const SyntheticScene scene = MakeScene(options);
  double error[2];
  for (const Loss loss : {Loss::kSquared, Loss::kCauchy}) {
    Bundle bundle = MakeBundle(scene, 0.01);
    for (size_t i = 0; i < bundle.observations.size(); i += 50) {
      bundle.observations[i].pixel.x() += 100;
    }
    BundleOptions solve;
    solve.loss = loss;
    solve.max_iterations = 100;
    ASSERT_TRUE(SolveBundle(solve, &bundle).usable);
    error[loss == Loss::kCauchy] = MaxCenterError(scene, bundle);
  }
  EXPECT_LT(error[1], 0.1 * error[0]);
}

// A dense and a sparse system with the same blocks, those of a walk of five photos and one camera.
TEST(ReducedSystem, DenseAndSparseCholeskyAgree) {
  constexpr int kNumPoses = 5;
  BundleLayout layout;
  layout.num_free_poses = kNumPoses;
  for (int i = 0; i < kNumPoses; ++i) layout.pose_row.push_back(6 * i);
  layout.camera_of_pose.assign(kNumPoses, 0);
  layout.camera_row = {6 * kNumPoses};
  layout.camera_size = {2};
  layout.size = 6 * kNumPoses + 2;
  PosePattern pattern(kNumPoses);
  for (int i = 0; i < kNumPoses; ++i) {
    pattern[i] = {i};
    if (i + 1 < kNumPoses) pattern[i].push_back(i + 1);
  }
  std::srand(1);  // Eigen's Random
  const auto dense = MakeDenseSystem(layout, 1), sparse = MakeSparseSystem(pattern, layout);
  const Eigen::MatrixXd J = Eigen::MatrixXd::Random(40, 12);
  const Eigen::MatrixXd K = Eigen::MatrixXd::Random(40, 2);
  for (ExplicitSystem* system : {dense.get(), sparse.get()}) {
    system->SetZero();
    for (int i = 0; i < kNumPoses; ++i) {
      const Eigen::Matrix<double, 40, 6> A = J.leftCols(6), B = J.rightCols(6);
      system->pose_block(6 * i) += A.transpose() * A;
      system->cross_block(6 * i, 2) += A.transpose() * K;
      if (i + 1 == kNumPoses) continue;
      system->schur().pose_block(6 * i, 6 * i + 6) += 0.1 * A.transpose() * B;
    }
    system->camera_block(6 * kNumPoses, 2) += 2 * kNumPoses * K.transpose() * K;
  }
  const Eigen::VectorXd b = Eigen::VectorXd::Random(layout.size);
  const Eigen::VectorXd damping = Eigen::VectorXd::Constant(layout.size, 10);
  Eigen::VectorXd x(layout.size), y(layout.size);
  ASSERT_TRUE(dense->Solve(damping, b, &x));
  ASSERT_TRUE(sparse->Solve(damping, b, &y));
  EXPECT_GT(x.norm(), 1e-3);
  EXPECT_LT((x - y).norm(), 1e-9 * x.norm());
}

TEST(Bundle, WithoutAFreePoseThePointsAreTriangulated) {
  SyntheticOptions options;
  options.noise_px = 0;
  const SyntheticScene scene = MakeScene(options);
  Bundle bundle = MakeBundle(scene, 0);
  for (BundlePose& pose : bundle.poses) pose.constant = true;
  for (BundlePoint& point : bundle.points) point.xyz.z() += 0.1;
  BundleOptions solve;
  solve.function_tolerance = 1e-12;
  const BundleSummary summary = SolveBundle(solve, &bundle);
  ASSERT_TRUE(summary.usable);
  EXPECT_EQ(summary.num_free_poses, 0);
  for (const BundlePoint& point : bundle.points) {
    EXPECT_LT((point.xyz - scene.points[point.point3D_id]).norm(), 1e-2);
  }
}

TEST(Bundle, AnEmptyBundleIsSolved) {
  Bundle bundle;
  const BundleSummary summary = SolveBundle({}, &bundle);
  EXPECT_TRUE(summary.usable);
  EXPECT_EQ(summary.final_cost, 0);
}

// A point that a wrong pose has behind it costs as much as 1,000 px, but moves nothing.
TEST(Bundle, APointBehindACameraLeavesTheRestSolvable) {
  SyntheticOptions options;
  options.noise_px = 0;
  const SyntheticScene scene = MakeScene(options);
  Bundle bundle = MakeBundle(scene, 0.02);
  BundlePoint& behind = bundle.points[0];
  behind.xyz = scene.Center(0) + 5 * (scene.Center(0) - scene.points[behind.point3D_id]);
  const Eigen::Vector3d before = behind.xyz;
  BundleOptions solve;
  solve.max_iterations = 100;
  solve.function_tolerance = 1e-12;
  ASSERT_TRUE(SolveBundle(solve, &bundle).usable);
  EXPECT_LT(MaxCenterError(scene, bundle), 1e-3);
  EXPECT_LT((bundle.points[0].xyz - before).norm(), 1e-3);
  const std::vector<double> errors = ReprojectionErrors(bundle);
  EXPECT_TRUE(std::isinf(errors[bundle.points[0].first]));
  EXPECT_LT(errors[bundle.points[1].first], 1);
}

}  // namespace skein::bundle_test
