#include "mapping/global_positions.h"

#include <ceres/ceres.h>

#include <algorithm>

namespace skein {
namespace {

// d v - (X - c): linear in depth, point and centre.
struct DepthResidual {
  template <typename T>
  bool operator()(const T* center, const T* point, const T* depth, T* residual) const {
    for (int i = 0; i < 3; ++i) residual[i] = depth[0] * T(v[i]) - (point[i] - center[i]);
    return true;
  }

  Eigen::Vector3d v;
};

// v - s (X - c), s the inverse of the depth: an error of the direction, however far the point is.
struct DirectionResidual {
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

class PositionSolver {
 public:
  PositionSolver(const std::vector<PointRays>& points, int num_threads,
                 const std::function<bool()>& stop)
      : points_(points), callback_(stop), xyz_(points.size(), Eigen::Vector3d::Zero()) {
    options_.linear_solver_type = ceres::SPARSE_SCHUR;
    options_.max_num_iterations = 100;
    options_.function_tolerance = 1e-5;
    options_.num_threads = num_threads;
    options_.logging_type = ceres::SILENT;
    options_.callbacks.push_back(&callback_);
    size_t num_rays = 0;
    for (const PointRays& point : points) {
      if (!IsUsed(point)) continue;
      num_rays += point.rays.size();
      for (const auto& ray : point.rays) index_.try_emplace(ray.image_id, index_.size());
    }
    depths_.assign(num_rays, 1.0);
    centers_.assign(index_.size(), Eigen::Vector3d::Zero());
  }

  // False if it failed or was stopped.
  bool Run() {
    constexpr double kHuber = 0.1, kCauchy = 0.02;
    ceres::HuberLoss huber(kHuber);
    if (!Solve<DepthResidual>(1, &huber)) return false;
    InvertDepths();
    ceres::CauchyLoss cauchy(kCauchy);
    return Solve<DirectionResidual>(1 / kMaxDepth, &cauchy);
  }

  std::map<uint32_t, Eigen::Vector3d> Centers() const {
    std::map<uint32_t, Eigen::Vector3d> centers;
    for (const auto& [id, index] : index_) centers[id] = centers_[index];
    return centers;
  }

 private:
  static constexpr double kMaxDepth = 1e5;

  static bool IsUsed(const PointRays& point) { return point.rays.size() >= 2; }

  // Ceres refuses a start outside of the bounds, and rays that are almost parallel meet anywhere.
  void InvertDepths() {
    for (double& depth : depths_) depth = 1 / std::min(depth, kMaxDepth);
  }

  // `bound`: the least value of a depth, or of its inverse.
  template <typename Residual>
  bool Solve(double bound, ceres::LossFunction* loss) {
    ceres::Problem::Options options;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ceres::Problem problem(options);
    auto* ordering = new ceres::ParameterBlockOrdering;
    options_.linear_solver_ordering.reset(ordering);
    double* depth = depths_.data();
    for (size_t k = 0; k < points_.size(); ++k) {
      if (!IsUsed(points_[k])) continue;
      for (const PointRays::Ray& ray : points_[k].rays) {
        problem.AddResidualBlock(
            new ceres::AutoDiffCostFunction<Residual, 3, 3, 3, 1>(new Residual{ray.direction}),
            loss, centers_[index_.at(ray.image_id)].data(), xyz_[k].data(), depth);
        problem.SetParameterLowerBound(depth, 0, bound);
        ordering->AddElementToGroup(depth++, 0);
      }
      ordering->AddElementToGroup(xyz_[k].data(), 1);
    }
    for (Eigen::Vector3d& center : centers_) ordering->AddElementToGroup(center.data(), 2);
    ceres::Solver::Summary summary;
    ceres::Solve(options_, &problem, &summary);
    return summary.IsSolutionUsable();
  }

  const std::vector<PointRays>& points_;
  StopCallback callback_;
  ceres::Solver::Options options_;
  std::map<uint32_t, size_t> index_;  // by image, in centers_
  // Ceres orders unknowns by their addresses: in one array each, so the result depends on nothing
  // else.
  std::vector<Eigen::Vector3d> centers_;
  std::vector<Eigen::Vector3d> xyz_;  // as points_
  std::vector<double> depths_;        // of each ray of used points; later their inverses
};

}  // namespace

std::map<uint32_t, Eigen::Vector3d> FindPositions(const std::vector<PointRays>& points,
                                                  int num_threads,
                                                  const std::function<bool()>& stop) {
  PositionSolver solver(points, num_threads, stop);
  return solver.Run() ? solver.Centers() : std::map<uint32_t, Eigen::Vector3d>();
}

}  // namespace skein
