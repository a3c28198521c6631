#include "mapping/global_positions.h"

#include <ceres/ceres.h>

#include <algorithm>

namespace skein {
namespace {

// A point's parameters are X and one number a ray. As one block they are eliminated together, which
// leaves a system of the centres alone.
constexpr int kFirstRay = 3;

// A ray's number: the depth, d v - (X - c), which is linear in depth, point and centre; or its
// inverse, v - s (X - c), an error of the direction, however far the point is.
enum class RayNumber { kDepth, kInverseDepth };

// Error of one ray of a point, over the centre and the point's block.
class RayError : public ceres::CostFunction {
 public:
  RayError(RayNumber number, const Eigen::Vector3d& direction, int ray, int num_rays)
      : is_inverse_(number == RayNumber::kInverseDepth),
        v_(direction),
        column_(kFirstRay + ray),
        size_(kFirstRay + num_rays) {
    set_num_residuals(3);
    *mutable_parameter_block_sizes() = {3, size_};
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Vector3d offset = Eigen::Map<const Eigen::Vector3d>(parameters[1]) -
                                   Eigen::Map<const Eigen::Vector3d>(parameters[0]);
    const double number = parameters[1][column_];
    const double of_offset = is_inverse_ ? number : 1;
    Eigen::Map<Eigen::Vector3d> error(residuals);
    error = (is_inverse_ ? 1 : number) * v_ - of_offset * offset;
    if (jacobians == nullptr) return true;
    const Eigen::Matrix3d wrt_center = of_offset * Eigen::Matrix3d::Identity();
    if (jacobians[0] != nullptr) Eigen::Map<Eigen::Matrix3d>{jacobians[0]} = wrt_center;
    if (jacobians[1] == nullptr) return true;
    using Block = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;
    Eigen::Map<Block> wrt_point(jacobians[1], 3, size_);
    wrt_point.setZero();
    wrt_point.leftCols<3>() = -wrt_center;
    wrt_point.col(column_) = is_inverse_ ? Eigen::Vector3d(-offset) : v_;
    return true;
  }

 private:
  const bool is_inverse_;
  const Eigen::Vector3d v_;
  const int column_, size_;
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
      : points_(points), callback_(stop) {
    options_.linear_solver_type = ceres::SPARSE_SCHUR;
    options_.max_num_iterations = 100;
    options_.function_tolerance = 1e-5;
    options_.num_threads = num_threads;
    options_.logging_type = ceres::SILENT;
    options_.callbacks.push_back(&callback_);
    for (const PointRays& point : points) {
      if (!IsUsed(point)) continue;
      blocks_.insert(blocks_.end(), kFirstRay, 0.0);
      blocks_.insert(blocks_.end(), point.rays.size(), 1.0);
      for (const auto& ray : point.rays) index_.try_emplace(ray.image_id, index_.size());
    }
    centers_.assign(index_.size(), Eigen::Vector3d::Zero());
  }

  // False if it failed or was stopped.
  bool Run() {
    constexpr double kHuber = 0.1, kCauchy = 0.02;
    ceres::HuberLoss huber(kHuber);
    if (!Solve(RayNumber::kDepth, 1, &huber)) return false;
    InvertDepths();
    ceres::CauchyLoss cauchy(kCauchy);
    return Solve(RayNumber::kInverseDepth, 1 / kMaxDepth, &cauchy);
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
    ForEachPoint([](const PointRays& point, double* block) {
      for (size_t i = 0; i < point.rays.size(); ++i) {
        double& depth = block[kFirstRay + i];
        depth = 1 / std::min(depth, kMaxDepth);
      }
    });
  }

  // `visit`: with the point and its block.
  template <typename Visit>
  void ForEachPoint(const Visit& visit) {
    double* block = blocks_.data();
    for (const PointRays& point : points_) {
      if (!IsUsed(point)) continue;
      visit(point, block);
      block += kFirstRay + point.rays.size();
    }
  }

  // `bound`: the least value of a ray's number.
  bool Solve(RayNumber number, double bound, ceres::LossFunction* loss) {
    ceres::Problem::Options options;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ceres::Problem problem(options);
    auto* ordering = new ceres::ParameterBlockOrdering;
    options_.linear_solver_ordering.reset(ordering);
    ForEachPoint([&](const PointRays& point, double* block) {
      const int num_rays = static_cast<int>(point.rays.size());
      for (int i = 0; i < num_rays; ++i) {
        const PointRays::Ray& ray = point.rays[i];
        problem.AddResidualBlock(new RayError(number, ray.direction, i, num_rays), loss,
                                 centers_[index_.at(ray.image_id)].data(), block);
        problem.SetParameterLowerBound(block, kFirstRay + i, bound);
      }
      ordering->AddElementToGroup(block, 0);
    });
    for (Eigen::Vector3d& center : centers_) ordering->AddElementToGroup(center.data(), 1);
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
  std::vector<double> blocks_;  // of used points: X, then the depths of its rays, later inverse
};

}  // namespace

std::map<uint32_t, Eigen::Vector3d> FindPositions(const std::vector<PointRays>& points,
                                                  int num_threads,
                                                  const std::function<bool()>& stop) {
  PositionSolver solver(points, num_threads, stop);
  return solver.Run() ? solver.Centers() : std::map<uint32_t, Eigen::Vector3d>();
}

}  // namespace skein
