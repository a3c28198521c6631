#include "bundle/bundle.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "bundle/bundle_factor.h"
#include "bundle/bundle_terms.h"
#include "bundle/conjugate_gradients.h"
#include "bundle/eliminated_points.h"
#include "bundle/point_terms.h"
#include "bundle/reduced_system.h"
#include "core/option_check.h"
#include "core/threads.h"

namespace skein {
namespace {

constexpr double kInitialDamping = 1e-4;
// Above it a step may be short because it is damped.
constexpr double kLittleDamping = 1e-5;
constexpr double kMaxDamping = 1e10;
// Conjugate gradients that a step takes with the factor of another one.
constexpr double kExpectedGradients = 20;

// Residuals beyond the unknowns; at least 1.
double RedundancyOf(const Bundle& bundle, const BundleLayout& layout) {
  const auto num_free = std::count_if(bundle.points.begin(), bundle.points.end(),
                                      [](const BundlePoint& point) { return !point.constant; });
  const double num_residuals = 2.0 * static_cast<double>(bundle.observations.size());
  return std::max(1.0, num_residuals - 3.0 * static_cast<double>(num_free) - layout.size);
}

class Solver {
 public:
  Solver(const BundleOptions& options, Bundle* bundle)
      : options_(options),
        bundle_(*bundle),
        layout_(MakeLayout(*bundle)),
        loss_{options.loss, options.loss_scale_px},
        start_(bundle->poses),
        has_scales_(HasScales(*bundle)),
        pattern_(ChoosePattern(options, *bundle, layout_)),
        redundancy_(RedundancyOf(*bundle, layout_)),
        chunks_(SplitPoints(*bundle)) {
    keeps_factor_ = !has_scales_ && IsDecomposingSlow();
    if (keeps_factor_) TakeFactor(options.factor);
  }

  BundleSummary Run() {
    BundleSummary summary;
    summary.num_free_poses = layout_.num_free_poses;
    double cost = Cost();
    summary.initial_cost = summary.final_cost = cost;
    double lambda = kInitialDamping;
    double growth = 2.0;
    while (summary.iterations < options_.max_iterations && lambda < kMaxDamping) {
      if (options_.cancel != nullptr && *options_.cancel) return summary;
      if (summary.iterations > 0 && options_.stop && options_.stop()) break;
      ++summary.iterations;
      const std::vector<BundlePose> poses = bundle_.poses;
      const std::vector<BundleCamera> cameras = bundle_.cameras;
      const std::vector<BundlePoint> points = bundle_.points;
      double predicted = 0;
      const bool solved = Step(lambda, &predicted);
      const double new_cost = solved ? Cost() : std::numeric_limits<double>::infinity();
      if (!(new_cost < cost)) {
        bundle_.poses = poses;
        bundle_.cameras = cameras;
        bundle_.points = points;
        lambda *= growth;
        growth *= 2.0;
        if (solved && new_cost - cost < options_.function_tolerance * cost) break;
        continue;
      }
      const double decrease = cost - new_cost;
      const double gain = predicted > 0 ? decrease / predicted : 1.0;
      lambda *= std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * gain - 1.0, 3));
      growth = 2.0;
      cost = new_cost;
      if (decrease < options_.function_tolerance * cost) break;
      if (lambda <= kLittleDamping && StepInSigmas(cost) < options_.camera_tolerance) break;
    }
    summary.final_cost = cost;
    summary.usable = std::isfinite(cost);
    summary.num_decompositions = num_decompositions_;
    summary.factor = factor_;
    return summary;
  }

 private:
  template <typename Function>
  void ForEachChunk(const Function& function) {
    const int num_chunks = static_cast<int>(chunks_.size());
    ForEachOnThreads(std::min(options_.num_threads, num_chunks), chunks_.size(), function);
  }

  double Cost() {
    std::vector<double> costs(chunks_.size());
    ForEachChunk([&](size_t i) {
      costs[i] = ReprojectionCost(bundle_, loss_, chunks_[i].begin, chunks_[i].end);
    });
    double sum = CameraPriorCost(bundle_) + PosePriorCost();
    for (const double cost : costs) sum += cost;
    return sum;
  }

  // Operations of summing and decomposing the Schur complement, beside those of conjugate gradients
  // without it.
  bool IsDecomposingSlow() const {
    constexpr double kBlockSpeed = 8;          // of the decomposition, which goes by large blocks
    constexpr double kIntrinsicsSlowness = 3;  // of blocks with a size known at run time alone
    double summing = 0, num_observations = 0;
    std::vector<const BundlePoint*> last_seen(bundle_.cameras.size(), nullptr);
    for (const BundlePoint& point : bundle_.points) {
      if (point.constant) continue;
      const double num_free = NumFreeObservations(point);
      const double num_intrinsics = NumIntrinsics(point, &last_seen);
      summing += 54 * num_free * num_free +
                 kIntrinsicsSlowness * num_intrinsics * (18 * num_free + 1.5 * num_intrinsics);
      num_observations += num_free;
    }
    const double size = layout_.size;
    const double decomposing = summing + size * size * size / 6 / kBlockSpeed;
    return decomposing > 2 * kExpectedGradients * (36 * num_observations + size * size);
  }

  int NumFreeObservations(const BundlePoint& point) const {
    const auto begin = bundle_.observations.begin() + point.first;
    return static_cast<int>(
        std::count_if(begin, begin + point.count, [this](const BundleObservation& observation) {
          return layout_.pose_row[observation.pose] >= 0;
        }));
  }

  // Of the cameras that see the point, each once. `last_seen`: by camera, the point counted last.
  int NumIntrinsics(const BundlePoint& point, std::vector<const BundlePoint*>* last_seen) const {
    int num_intrinsics = 0;
    for (int i = point.first; i < point.first + point.count; ++i) {
      const int camera = bundle_.poses[bundle_.observations[i].pose].camera;
      if (std::exchange((*last_seen)[camera], &point) == &point) continue;
      num_intrinsics += static_cast<int>(bundle_.cameras[camera].refined.size());
    }
    return num_intrinsics;
  }

  void TakeFactor(std::shared_ptr<const BundleFactor> factor) {
    factor_ = std::move(factor);
    if (factor_ != nullptr) factor_rows_ = factor_->RowsOf(bundle_, layout_);
  }

  // Solves the damped normal equations and moves the bundle. `predicted`: the decrease of the cost
  // by the linear model.
  bool Step(double lambda, double* predicted) {
    Eigen::VectorXd y(layout_.size);
    StepTerms terms;
    const bool solved = (keeps_factor_ && SolveByGradients(lambda, &terms, &y)) ||
                        SolveByDecomposing(lambda, &terms, &y);
    if (!solved) return false;
    gain_of_cameras_ = 0.5 * y.dot(terms.b);
    const Eigen::VectorXd delta = WithPoseSteps(y);
    *predicted =
        has_scales_ ? 0.0 : 0.5 * delta.dot(terms.damping.cwiseProduct(delta) - terms.gradient);
    std::vector<double> gains(chunks_.size());
    ForEachChunk([&](size_t i) { gains[i] = eliminated_[i].Move(y, &bundle_.points); });
    for (const double gain : gains) *predicted += gain;
    MoveCameras(delta);
    return true;
  }

  // Root mean square of the last step of poses and intrinsics, each in its standard deviation. The
  // points' own gains do not count: with a robust loss those of outliers go on long after the poses
  // are at rest.
  double StepInSigmas(double cost) const {
    if (layout_.size == 0) return std::numeric_limits<double>::infinity();
    const double variance = 2 * cost / redundancy_;
    return std::sqrt(2 * gain_of_cameras_ / (variance * layout_.size));
  }

  // Of the cameras' normal equations.
  struct StepTerms {
    Eigen::VectorXd damping, gradient, b;
  };

  bool SolveByDecomposing(double lambda, StepTerms* terms, Eigen::VectorXd* y) {
    ++num_decompositions_;
    while (explicit_.size() < chunks_.size()) explicit_.push_back(MakeEmptySystem());
    ForEachChunk([&](size_t i) {
      explicit_[i]->SetZero();
      Accumulate(i, lambda, explicit_[i].get(),
                 [&](const PointTerms& point) { AddSchurBlocks(point, &explicit_[i]->schur()); });
    });
    *terms = SumUp(lambda, explicit_);
    return layout_.size == 0 || explicit_[0]->Solve(terms->damping, terms->b, y);
  }

  std::unique_ptr<ExplicitSystem> MakeEmptySystem() const {
    return MakeSystem(pattern_, layout_, options_.num_threads);
  }

  // With the factor of an earlier step or bundle, else with one of this step.
  bool SolveByGradients(double lambda, StepTerms* terms, Eigen::VectorXd* y) {
    while (direct_.size() < chunks_.size()) {
      direct_.push_back(std::make_unique<ReducedSystem>(layout_));
    }
    ForEachChunk([&](size_t i) {
      direct_[i]->SetZero();
      Accumulate(i, lambda, direct_[i].get(), [](const PointTerms&) {});
    });
    *terms = SumUp(lambda, direct_);
    if (factor_ != nullptr && RunGradients(*terms, y)) return true;
    return DecomposeInPieces(lambda, *terms) && RunGradients(*terms, y);
  }

  bool RunGradients(const StepTerms& terms, Eigen::VectorXd* y) {
    const ConjugateGradients gradients{
        *direct_[0], eliminated_, *factor_, factor_rows_,
        [this](const std::function<void(size_t)>& function) { ForEachChunk(function); }};
    return gradients.Solve(terms.damping, terms.b, y);
  }

  bool DecomposeInPieces(double lambda, const StepTerms& terms) {
    ++num_decompositions_;
    std::vector<std::unique_ptr<ExplicitSystem>> parts;
    while (parts.size() < chunks_.size()) parts.push_back(MakeEmptySystem());
    ForEachChunk([&](size_t i) { AccumulatePieces(chunks_[i], lambda, parts[i].get()); });
    SumUp(lambda, parts);
    Eigen::VectorXd unused(layout_.size);
    if (!parts[0]->Solve(terms.damping, terms.b, &unused)) return false;
    TakeFactor(std::make_shared<BundleFactor>(bundle_, layout_, std::move(parts[0])));
    return true;
  }

  // Into the first of the parts.
  template <typename System>
  StepTerms SumUp(double lambda, const std::vector<std::unique_ptr<System>>& parts) {
    System& system = *parts[0];
    for (size_t i = 1; i < parts.size(); ++i) system.Add(*parts[i]);
    if (prior_information_.empty()) SetPosePriors(system);
    AddPriors(&system);
    return {lambda * system.Diagonal().cwiseMax(kMinDiagonal), system.gradient,
            system.schur_gradient - WithPoseScales(system.gradient)};
  }

  // Adds a chunk's observations to `system`; keeps its free points, each of which `use` gets, too.
  template <typename Use>
  void Accumulate(size_t chunk, double lambda, ReducedSystem* system, const Use& use) {
    EliminatedPoints& eliminated = eliminated_[chunk];
    eliminated.Begin(bundle_, chunks_[chunk]);
    PointTerms terms;
    for (int p = chunks_[chunk].begin; p < chunks_[chunk].end; ++p) {
      terms.Set(bundle_, layout_, loss_, bundle_.points[p], lambda);
      AddDirect(terms, system);
      if (bundle_.points[p].constant) continue;
      terms.SetCouplings();
      AddSchurGradient(terms, system);
      eliminated.Add(p, terms);
      use(terms);
    }
  }

  // For the matrix alone: the right-hand side is that of whole points.
  void AccumulatePieces(const PointRange& chunk, double lambda, ExplicitSystem* system) {
    system->SetZero();
    PointTerms terms;
    for (int p = chunk.begin; p < chunk.end; ++p) {
      const BundlePoint& point = bundle_.points[p];
      const int num_pieces = NumPieces(point);
      for (int piece = 0; piece < num_pieces; ++piece) {
        terms.Set(bundle_, layout_, loss_, point, lambda, piece, num_pieces);
        AddDirect(terms, system);
        if (point.constant) continue;
        terms.SetCouplings();
        AddSchurBlocks(terms, &system->schur());
      }
    }
  }

  void MoveCameras(const Eigen::VectorXd& delta) {
    for (size_t i = 0; i < bundle_.poses.size(); ++i) {
      if (layout_.pose_row[i] < 0) continue;
      IncrementPose(delta.segment<6>(layout_.pose_row[i]), &bundle_.poses[i]);
    }
    for (size_t i = 0; i < bundle_.cameras.size(); ++i) {
      BundleCamera& camera = bundle_.cameras[i];
      for (size_t k = 0; k < camera.refined.size(); ++k) {
        camera.params[camera.refined[k]] += delta[layout_.camera_row[i] + k];
      }
      if (camera.square_pixels) camera.params[1] = camera.params[0];
    }
  }

  // The prior's information of each free pose: `rigidity` times its own block before the first
  // step.
  void SetPosePriors(const ReducedSystem& system) {
    prior_information_.assign(bundle_.poses.size(), Eigen::Matrix<double, 6, 6>::Zero());
    for (size_t i = 0; i < bundle_.poses.size(); ++i) {
      const int row = layout_.pose_row[i];
      const double rigidity = bundle_.poses[i].stiffness.rigidity;
      if (row >= 0 && rigidity > 0) prior_information_[i] = rigidity * system.pose_block(row);
    }
  }

  double PosePriorCost() const {
    double cost = 0;
    for (size_t i = 0; i < prior_information_.size(); ++i) {
      if (layout_.pose_row[i] < 0) continue;
      const auto delta = PoseIncrement(start_[i], bundle_.poses[i]);
      cost += 0.5 * delta.dot(prior_information_[i] * delta);
    }
    return cost;
  }

  void AddPriors(ReducedSystem* system) {
    for (size_t i = 0; i < bundle_.poses.size(); ++i) {
      const int row = layout_.pose_row[i];
      if (row < 0 || !(bundle_.poses[i].stiffness.rigidity > 0)) continue;
      system->pose_block(row) += prior_information_[i];
      system->gradient.segment<6>(row) +=
          prior_information_[i] * PoseIncrement(start_[i], bundle_.poses[i]);
    }
    for (size_t i = 0; i < bundle_.cameras.size(); ++i) AddCameraPrior(i, system);
  }

  void AddCameraPrior(size_t i, ReducedSystem* system) {
    const BundleCamera& camera = bundle_.cameras[i];
    for (size_t k = 0; k < camera.refined.size(); ++k) {
      const int param = camera.refined[k];
      const double information = PriorInformation(camera, param);
      if (information == 0) continue;
      const int row = layout_.camera_row[i];
      system->camera_block(row, layout_.camera_size[i])(k, k) += information;
      system->gradient[row + static_cast<int>(k)] +=
          information * (camera.params[param] - camera.prior[param]);
    }
  }

  // The unknown that is solved for is the step times the scale.
  Eigen::VectorXd WithPoseScales(const Eigen::VectorXd& gradient) const {
    return ScalePoses(gradient, [](double scale) { return scale; });
  }
  Eigen::VectorXd WithPoseSteps(const Eigen::VectorXd& y) const {
    return ScalePoses(y, [](double scale) { return 1.0 / scale; });
  }
  template <typename Function>
  Eigen::VectorXd ScalePoses(Eigen::VectorXd v, const Function& factor) const {
    if (!has_scales_) return v;
    for (size_t i = 0; i < bundle_.poses.size(); ++i) {
      if (layout_.pose_row[i] < 0) continue;
      v.segment<6>(layout_.pose_row[i]) *= factor(bundle_.poses[i].stiffness.gradient_scale);
    }
    return v;
  }
  static bool HasScales(const Bundle& bundle) {
    return std::any_of(bundle.poses.begin(), bundle.poses.end(), [](const BundlePose& pose) {
      return !pose.constant && pose.stiffness.gradient_scale != 1;
    });
  }

  const BundleOptions options_;
  Bundle& bundle_;
  const BundleLayout layout_;
  const RobustLoss loss_;
  const std::vector<BundlePose> start_;
  const bool has_scales_;
  const PosePattern pattern_;
  const double redundancy_;
  const std::vector<PointRange> chunks_;  // each with a system of its own
  bool keeps_factor_ = false;
  double gain_of_cameras_ =
      0;  // decrease of the cost that the last step of poses and intrinsics brings
  std::vector<std::unique_ptr<ExplicitSystem>> explicit_;  // one a chunk
  std::vector<std::unique_ptr<ReducedSystem>> direct_;     // one a chunk
  std::vector<EliminatedPoints> eliminated_{chunks_.size()};
  std::shared_ptr<const BundleFactor> factor_;
  std::vector<int> factor_rows_;
  int num_decompositions_ = 0;
  std::vector<Eigen::Matrix<double, 6, 6>> prior_information_;
};

}  // namespace

Status BundleOptions::Check() const {
  return FirstError({InRange("max_iterations", max_iterations, 0, 100'000),
                     InRange("function_tolerance", function_tolerance, 0.0, 1.0),
                     InRange("camera_tolerance", camera_tolerance, 0.0, 1.0),
                     InRange("loss_scale_px", loss_scale_px, 1e-6, 1e6),
                     InRange("num_threads", num_threads, 1, 1024)});
}

BundleSummary SolveBundle(const BundleOptions& options, Bundle* bundle) {
  ThrowUnlessSound(options.Check());
  Bundle refined = *bundle;
  const BundleSummary summary = Solver(options, &refined).Run();
  if (summary.usable) *bundle = std::move(refined);
  return summary;
}

}  // namespace skein
