#include "mapping/global_positions.h"

#include <ceres/ceres.h>

namespace skein {
namespace {

// Errors of a ray v over a centre c and a point X, each at the best number of the ray, which a
// formula gives: so a point of k rays has 3 unknowns in place of 3 + k.

// d v - (X - c) at the best depth, d = max(1, v . (X - c)).
struct DepthError {
  static Eigen::Vector3d At(const Eigen::Vector3d& v, const Eigen::Vector3d& offset,
                            Eigen::Matrix3d* by_offset) {
    const double depth = v.dot(offset);
    const bool is_free = depth > 1;
    *by_offset = -Eigen::Matrix3d::Identity();
    if (is_free) *by_offset += v * v.transpose();
    return (is_free ? depth : 1) * v - offset;
  }
};

// v - s (X - c), an error of the direction, however far the point is, at the best inverse depth,
// s = v . (X - c) / |X - c|^2, which is no less than that of the farthest points.
struct DirectionError {
  static constexpr double kMinInverseDepth = 1e-5;

  static Eigen::Vector3d At(const Eigen::Vector3d& v, const Eigen::Vector3d& offset,
                            Eigen::Matrix3d* by_offset) {
    const double along = v.dot(offset), squared = offset.squaredNorm();
    if (along <= kMinInverseDepth * squared) {
      *by_offset = -kMinInverseDepth * Eigen::Matrix3d::Identity();
      return v - kMinInverseDepth * offset;
    }
    const double inverse = along / squared;
    const Eigen::Vector3d gradient = (v - 2 * inverse * offset) / squared;
    *by_offset = -inverse * Eigen::Matrix3d::Identity() - offset * gradient.transpose();
    return v - inverse * offset;
  }
};

template <typename Error>
class RayError : public ceres::SizedCostFunction<3, 3, 3> {
 public:
  explicit RayError(const Eigen::Vector3d& direction) : v_(direction) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::Vector3d> center(parameters[0]), point(parameters[1]);
    Eigen::Matrix3d by_offset;
    Eigen::Map<Eigen::Vector3d>{residuals} = Error::At(v_, point - center, &by_offset);
    if (jacobians == nullptr) return true;
    using Block = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    if (jacobians[0] != nullptr) Eigen::Map<Block>{jacobians[0]} = -by_offset;
    if (jacobians[1] != nullptr) Eigen::Map<Block>{jacobians[1]} = by_offset;
    return true;
  }

 private:
  const Eigen::Vector3d v_;
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
      for (const auto& ray : point.rays) index_.try_emplace(ray.image_id, index_.size());
    }
    centers_.assign(index_.size(), Eigen::Vector3d::Zero());
    xyz_.assign(points.size(), Eigen::Vector3d::Zero());
  }

  // False if it failed or was stopped.
  bool Run() {
    constexpr double kHuber = 0.1, kCauchy = 0.02;
    ceres::HuberLoss huber(kHuber);
    ceres::CauchyLoss cauchy(kCauchy);
    return Solve<DepthError>(&huber) && Solve<DirectionError>(&cauchy);
  }

  std::map<uint32_t, Eigen::Vector3d> Centers() const {
    std::map<uint32_t, Eigen::Vector3d> centers;
    for (const auto& [id, index] : index_) centers[id] = centers_[index];
    return centers;
  }

 private:
  static bool IsUsed(const PointRays& point) { return point.rays.size() >= 2; }

  template <typename Error>
  bool Solve(ceres::LossFunction* loss) {
    ceres::Problem::Options options;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ceres::Problem problem(options);
    auto* ordering = new ceres::ParameterBlockOrdering;
    options_.linear_solver_ordering.reset(ordering);
    for (size_t k = 0; k < points_.size(); ++k) {
      if (!IsUsed(points_[k])) continue;
      for (const PointRays::Ray& ray : points_[k].rays) {
        problem.AddResidualBlock(new RayError<Error>(ray.direction), loss,
                                 centers_[index_.at(ray.image_id)].data(), xyz_[k].data());
      }
      ordering->AddElementToGroup(xyz_[k].data(), 0);
    }
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
  std::vector<Eigen::Vector3d> centers_, xyz_;
};

}  // namespace

std::map<uint32_t, Eigen::Vector3d> FindPositions(const std::vector<PointRays>& points,
                                                  int num_threads,
                                                  const std::function<bool()>& stop) {
  PositionSolver solver(points, num_threads, stop);
  return solver.Run() ? solver.Centers() : std::map<uint32_t, Eigen::Vector3d>();
}

}  // namespace skein
