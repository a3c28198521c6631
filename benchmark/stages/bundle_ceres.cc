// Skein's bundle adjustment beside Ceres on whole maps. The bundle of a map holds all of its poses
// and points, and its cameras with the mapper's weak priors. Poses and points are disturbed; every
// solver starts from the same disturbed bundle. At most 100 iterations, COLMAP's default, so that
// tolerances decide. "COLMAP's mapper" has 50.
//
//   OMP_NUM_THREADS=1 bundle_ceres --model DIR [DIR...] [--threads 1] [--seed 1]
//     [--pose-noise 0.002] [--point-noise 0.002]
//
// Columns:
//   CPU s, wall s: from the plain bundle to the refined one
//   iterations:    linear systems solved
//   cost:          half the sum of the robust squared residuals, computed alike for all solvers
//   above least:   (cost - least cost of the map's rows) / least cost
//   RMSE:          of positions after a similarity, to the first row's
// Ceres's sparse Schur complement runs on CHOLMOD, whose threads OMP_NUM_THREADS caps.

#include <ceres/version.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bundle/bundle.h"
#include "bundle/bundle_terms.h"
#include "core/clock.h"
#include "core/limits.h"
#include "core/process.h"
#include "geometry/pose_evaluation.h"
#include "map/bundle_assembly.h"
#include "map/bundle_builder.h"
#include "sfm/model_files.h"
#include "testing/ceres_bundle.h"
#include "testing/test_random.h"

namespace skein {
namespace {

constexpr int kMaxIterations = 100;
// COLMAP 3.8, IncrementalMapperOptions::GlobalBundleAdjustment.
constexpr int kMapperIterations = 50, kMapperLinearIterations = 100;
constexpr double kMapperGradientTolerance = 1.0;

struct Arguments {
  std::vector<std::string> models;
  int threads = 1;
  double pose_noise = 0.002;
  double point_noise = 0.002;
  unsigned seed = 1;
};

// Returns the number of iterations.
struct BundleSolver {
  std::string name;
  std::function<int(Bundle*)> solve;
};

struct Solution {
  Bundle bundle;
  int iterations = 0;
  double cpu_s = 0, wall_s = 0, cost = 0;
};

// As map/bundle_builder.h has it. A model does not tell the focal length that a camera came with:
// its own is the prior's centre.
BundleCamera MakeCamera(const Camera& camera) {
  BundleCamera result;
  result.camera_id = camera.CameraId();
  result.model_id = camera.ModelId();
  result.params = result.prior = camera.Params();
  result.prior_sigma.assign(result.params.size(), 0.0);
  for (const size_t i : camera.FocalLengthIdxs()) {
    result.prior_sigma[i] = limits::kFocalSigmaExif * result.prior[i];
    result.refined.push_back(static_cast<int>(i));
  }
  for (const size_t i : camera.ExtraParamsIdxs()) {
    result.prior[i] = 0;
    result.prior_sigma[i] = limits::kDistortionSigma;
    result.refined.push_back(static_cast<int>(i));
  }
  return result;
}

Bundle MakeGlobalBundle(const Reconstruction& model) {
  BundleAssembly assembly(model, [&](CameraId id) { return MakeCamera(model.Camera(id)); });
  for (const ImageId id : model.RegImageIds()) assembly.AddPose(id, false);
  std::vector<Point3DId> points;
  for (const auto& [id, point] : model.Points3D()) points.push_back(id);
  std::sort(points.begin(), points.end());
  for (const Point3DId id : points) assembly.AddPoint(id);
  Bundle bundle = assembly.Take();
  ScalePriors(&bundle);
  return bundle;
}

ModelPoses PosesOf(const Bundle& bundle) {
  ModelPoses model;
  for (const BundlePose& pose : bundle.poses) {
    model.poses.push_back(
        {std::to_string(pose.image_id), {Eigen::Quaterniond(pose.R).normalized(), pose.t}});
  }
  return model;
}

PoseEvaluation Evaluate(const Bundle& bundle, const Bundle& reference) {
  const Result<PoseEvaluation> evaluation = EvaluatePoses(PosesOf(bundle), PosesOf(reference));
  if (!evaluation) throw std::runtime_error(evaluation.error());
  return *evaluation;
}

// Noise is Gaussian, with a share of the map's extent as each coordinate's standard deviation.
// Poses turn by as many radians as their share.
void Disturb(const Arguments& arguments, Bundle* bundle) {
  const double extent = Evaluate(*bundle, *bundle).extent;
  std::mt19937 random(arguments.seed);
  for (BundlePose& pose : bundle->poses) {
    Eigen::Matrix<double, 6, 1> delta;
    delta.head<3>() = Normal3(arguments.pose_noise, &random);
    delta.tail<3>() = Normal3(arguments.pose_noise * extent, &random);
    IncrementPose(delta, &pose);
  }
  for (BundlePoint& point : bundle->points) {
    point.xyz += Normal3(arguments.point_noise * extent, &random);
  }
}

// COLMAP leaves them out, too: a residual behind a camera means nothing.
Bundle WithoutPointsBehindCameras(const Bundle& bundle) {
  const std::vector<double> errors = ReprojectionErrors(bundle);
  Bundle kept{bundle.poses, bundle.cameras, {}, {}};
  for (BundlePoint point : bundle.points) {
    const auto error = errors.begin() + point.first;
    if (!std::all_of(error, error + point.count, [](double e) { return std::isfinite(e); })) {
      continue;
    }
    const auto observation = bundle.observations.begin() + point.first;
    point.first = static_cast<int>(kept.observations.size());
    kept.points.push_back(point);
    kept.observations.insert(kept.observations.end(), observation, observation + point.count);
  }
  return kept;
}

double CostOf(const Bundle& bundle) {
  const BundleOptions options;
  const RobustLoss loss{options.loss, options.loss_scale_px};
  return ReprojectionCost(bundle, loss, 0, static_cast<int>(bundle.points.size())) +
         CameraPriorCost(bundle);
}

BundleSolver SkeinSolver(const std::string& name, BundleOptions options) {
  options.max_iterations = kMaxIterations;
  return {name, [=](Bundle* bundle) {
            const BundleSummary summary = SolveBundle(options, bundle);
            if (!summary.usable) throw std::runtime_error(name + " failed");
            return summary.iterations;
          }};
}

BundleSolver CeresSolver(const std::string& name, const CeresOptions& options) {
  return {name, [=](Bundle* bundle) {
            const CeresSummary summary = SolveByCeres(options, bundle);
            if (!summary.usable) throw std::runtime_error(name + " failed");
            return summary.iterations;
          }};
}

// The first is the reference of positions.
std::vector<BundleSolver> MakeSolvers(int threads) {
  BundleOptions mapper;
  mapper.num_threads = threads;
  BundleOptions by_cost = mapper;
  by_cost.function_tolerance = 1e-6;
  by_cost.camera_tolerance = 0;
  CeresOptions adjuster;
  adjuster.max_iterations = kMaxIterations;
  adjuster.num_threads = threads;
  CeresOptions colmap_mapper = adjuster;
  colmap_mapper.max_iterations = kMapperIterations;
  colmap_mapper.max_linear_iterations = kMapperLinearIterations;
  colmap_mapper.gradient_tolerance = kMapperGradientTolerance;
  CeresOptions ceres_by_cost = adjuster;
  ceres_by_cost.function_tolerance = by_cost.function_tolerance;
  return {CeresSolver("Ceres, COLMAP's bundle_adjuster", adjuster),
          CeresSolver("Ceres, COLMAP's mapper", colmap_mapper),
          CeresSolver("Ceres, function_tolerance 1e-6", ceres_by_cost),
          SkeinSolver("Skein, function_tolerance 1e-6", by_cost),
          SkeinSolver("Skein, the mapper's tolerances", mapper)};
}

Solution SolveBy(const BundleSolver& solver, const Bundle& start) {
  Solution solution;
  solution.bundle = start;
  const double cpu_s = CpuTimeS();
  const Timer wall;
  solution.iterations = solver.solve(&solution.bundle);
  solution.wall_s = wall.ElapsedS();
  solution.cpu_s = CpuTimeS() - cpu_s;
  solution.cost = CostOf(solution.bundle);
  return solution;
}

void Print(const std::vector<BundleSolver>& solvers, const std::vector<Solution>& solutions) {
  double least = solutions[0].cost;
  for (const Solution& solution : solutions) least = std::min(least, solution.cost);
  std::printf(
      "| solver | CPU s | wall s | iterations | cost | above least, %% | RMSE, %% of extent |\n"
      "|---|---|---|---|---|---|---|\n");
  for (size_t i = 0; i < solutions.size(); ++i) {
    const Solution& solution = solutions[i];
    const PoseEvaluation evaluation = Evaluate(solution.bundle, solutions[0].bundle);
    std::printf("| %s | %.2f | %.2f | %d | %.1f | %.4f | %.5f |\n", solvers[i].name.c_str(),
                solution.cpu_s, solution.wall_s, solution.iterations, solution.cost,
                100 * (solution.cost - least) / least,
                evaluation.PositionPercent(evaluation.position.rmse));
  }
  std::printf("\n");
  std::fflush(stdout);
}

void Compare(const Arguments& arguments, const std::string& folder) {
  const Result<Reconstruction> model = ReadModelFiles(folder);
  if (!model) throw std::runtime_error(model.error());
  Bundle disturbed = MakeGlobalBundle(*model);
  const size_t num_points = disturbed.points.size();
  const double cost_of_model = CostOf(disturbed);
  Disturb(arguments, &disturbed);
  const Bundle start = WithoutPointsBehindCameras(disturbed);
  std::printf(
      "%s: %zu photos, %zu cameras, %zu points (%zu left out), %zu observations; cost of the model "
      "%.1f, at the start %.1f\n\n",
      folder.c_str(), start.poses.size(), start.cameras.size(), start.points.size(),
      num_points - start.points.size(), start.observations.size(), cost_of_model, CostOf(start));
  std::fflush(stdout);
  const std::vector<BundleSolver> solvers = MakeSolvers(arguments.threads);
  std::vector<Solution> solutions;
  for (const BundleSolver& solver : solvers) solutions.push_back(SolveBy(solver, start));
  Print(solvers, solutions);
}

void Run(const Arguments& arguments) {
  std::printf("commit %s, %s, Ceres %s, %d threads, noise %g (poses), %g (points), seed %u\n\n",
              SKEIN_COMMIT, HostName().c_str(), CERES_VERSION_STRING, arguments.threads,
              arguments.pose_noise, arguments.point_noise, arguments.seed);
  for (const std::string& folder : arguments.models) Compare(arguments, folder);
}

}  // namespace
}  // namespace skein

int main(int argc, char** argv) {
  skein::Arguments arguments;
  CLI::App app("Skein's bundle adjustment beside Ceres on whole maps");
  app.add_option("--model", arguments.models, "COLMAP models, one comparison each")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("--threads", arguments.threads, "Of each solver")->check(CLI::Range(1, 1024));
  app.add_option("--pose-noise", arguments.pose_noise,
                 "Of positions, as a share of the extent, and of rotations, in radians")
      ->check(CLI::Range(0.0, 1.0));
  app.add_option("--point-noise", arguments.point_noise, "Of points, as a share of the extent")
      ->check(CLI::Range(0.0, 1.0));
  app.add_option("--seed", arguments.seed, "Of the noise");
  CLI11_PARSE(app, argc, argv);
  try {
    skein::Run(arguments);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bundle_ceres: %s\n", error.what());
    return 1;
  }
  return 0;
}
