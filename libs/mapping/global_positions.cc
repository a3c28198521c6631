#include "mapping/global_positions.h"

#include <ceres/ceres.h>

#include <random>

namespace skein {
namespace {

// v - d (X - c).
struct RayResidual {
  explicit RayResidual(const Eigen::Vector3d& direction) : v(direction) {}

  template <typename T>
  bool operator()(const T* center, const T* point, const T* scale, T* residual) const {
    for (int i = 0; i < 3; ++i) residual[i] = T(v[i]) - scale[0] * (point[i] - center[i]);
    return true;
  }

  Eigen::Vector3d v;
};

class StopCallback : public ceres::IterationCallback {
 public:
  explicit StopCallback(const std::function<bool()>& stop) : stop_(stop) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    return stop_ && stop_() ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
  }

 private:
  const std::function<bool()>& stop_;
};

}  // namespace

std::map<uint32_t, Eigen::Vector3d> FindPositions(const std::vector<PointRays>& points,
                                                  int num_threads,
                                                  const std::function<bool()>& stop) {
  constexpr double kExtent = 100, kHuber = 0.1, kCauchy = 0.02, kMinScale = 1e-5;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-kExtent, kExtent);
  const auto anywhere = [&] {
    const double x = uniform(random), y = uniform(random), z = uniform(random);
    return Eigen::Vector3d(x, y, z);
  };
  std::map<uint32_t, Eigen::Vector3d> centers;
  size_t num_rays = 0;
  for (const PointRays& point : points) {
    if (point.rays.size() < 2) continue;
    for (const auto& ray : point.rays) centers[ray.image_id];
    num_rays += point.rays.size();
  }
  for (auto& [id, center] : centers) center = anywhere();
  std::vector<Eigen::Vector3d> xyz(points.size());
  std::vector<double> scales(num_rays, 1.0);
  ceres::Problem::Options problem_options;
  problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::LossFunctionWrapper loss(new ceres::HuberLoss(kHuber), ceres::TAKE_OWNERSHIP);
  ceres::Problem problem(problem_options);
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  size_t next = 0;
  for (size_t k = 0; k < points.size(); ++k) {
    if (points[k].rays.size() < 2) continue;
    xyz[k] = anywhere();
    for (const auto& ray : points[k].rays) {
      double* scale = &scales[next++];
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<RayResidual, 3, 3, 3, 1>(new RayResidual(ray.direction)),
          &loss, centers.at(ray.image_id).data(), xyz[k].data(), scale);
      problem.SetParameterLowerBound(scale, 0, kMinScale);
      ordering->AddElementToGroup(scale, 0);
    }
    ordering->AddElementToGroup(xyz[k].data(), 1);
  }
  for (auto& [id, center] : centers) ordering->AddElementToGroup(center.data(), 2);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_SCHUR;
  options.linear_solver_ordering.reset(new ceres::ParameterBlockOrdering(*ordering));
  options.max_num_iterations = 100;
  options.function_tolerance = 1e-5;
  options.num_threads = num_threads;
  options.logging_type = ceres::SILENT;
  StopCallback callback(stop);
  options.callbacks.push_back(&callback);
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) return {};
  loss.Reset(new ceres::CauchyLoss(kCauchy), ceres::TAKE_OWNERSHIP);
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) return {};
  return centers;
}

}  // namespace skein
