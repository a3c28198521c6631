#include "bundle/loosest_mode.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <stdexcept>
#include <utility>

#include "bundle/point_terms.h"
#include "bundle/reduced_system.h"
#include "core/angles.h"
#include "core/threads.h"

namespace skein {
namespace {

constexpr int kLanczosIterations = 20;
// Of the first product: what is shorter is rounding.
constexpr double kNothingLeft = 1e-9;
// A point of which the rays are parallel to numerical precision says nothing of positions.
constexpr double kMaxConditionOfPoint = 1e12;
// Between directions that copies and bursts of one photo see a point from.
constexpr double kSameDirectionDeg = 0.2;

using Matrix7d = Eigen::Matrix<double, 7, 7>;
using Vector7d = Eigen::Matrix<double, 7, 1>;
using Centers = std::vector<Eigen::Vector3d>;

Centers CentersOf(const Bundle& bundle) {
  Centers centers;
  for (const BundlePose& pose : bundle.poses) centers.push_back(-(pose.R.transpose() * pose.t));
  return centers;
}

// Displacements of centres by small similarities, each centre in a frame of unit size.
class Similarities {
 public:
  explicit Similarities(Centers centers) : centers_(std::move(centers)) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& c : centers_) mean += c / static_cast<double>(centers_.size());
    double squared = 0;
    for (Eigen::Vector3d& c : centers_) squared += (c -= mean).squaredNorm();
    const double size = std::sqrt(squared / static_cast<double>(centers_.size()));
    if (size > 0)
      for (Eigen::Vector3d& c : centers_) c /= size;
  }

  // Translation, rotation, scale: columns.
  Eigen::Matrix<double, 3, 7> Basis(int i) const {
    const Eigen::Vector3d& c = centers_[i];
    Eigen::Matrix<double, 3, 7> basis;
    basis.leftCols<3>().setIdentity();
    basis.middleCols<3>(3) << 0, c.z(), -c.y(), -c.z(), 0, c.x(), c.y(), -c.x(), 0;
    basis.col(6) = c;
    return basis;
  }

 private:
  Centers centers_;
};

// Normal equations of a similarity for the displacements of some centres. They add up.
struct SimilarityFit {
  Matrix7d N = Matrix7d::Zero();
  Vector7d b = Vector7d::Zero();
  int num = 0;

  void Add(const Eigen::Matrix<double, 3, 7>& basis, const Eigen::Vector3d& displacement) {
    N += basis.transpose() * basis;
    b += basis.transpose() * displacement;
    ++num;
  }
  void Add(const SimilarityFit& other) {
    N += other.N;
    b += other.b;
    num += other.num;
  }
  // Pseudo-inverse: few centres, or those on a line, leave a similarity undetermined.
  Vector7d Solve() const {
    const Eigen::SelfAdjointEigenSolver<Matrix7d> eigen(N);
    const double least = 1e-9 * eigen.eigenvalues()[6];
    Vector7d x = Vector7d::Zero();
    for (int i = 0; i < 7; ++i) {
      if (eigen.eigenvalues()[i] <= least) continue;
      const Vector7d v = eigen.eigenvectors().col(i);
      x += v * (v.dot(b) / eigen.eigenvalues()[i]);
    }
    return x;
  }
  // Of the squared displacements.
  double Explained() const { return b.dot(Solve()); }
};

// The reduced system without damping, decomposed. Seven conditions hold its gauge: a pose, and the
// distance of another one from it.
class ReducedCovariance {
 public:
  ReducedCovariance(const Bundle& bundle, int num_threads)
      : bundle_(bundle),
        layout_(MakeLayout(bundle)),
        centers_(CentersOf(bundle)),
        num_threads_(num_threads) {
    if (layout_.num_free_poses != static_cast<int>(bundle.poses.size())) {
      throw std::invalid_argument("loosest mode: a pose is constant");
    }
  }

  // False if the system is singular.
  bool Decompose() {
    SumUpPoints();
    if (redundancy_ <= 0) return false;
    AddPriors();
    const Eigen::VectorXd damping = HoldGauge();
    Eigen::VectorXd unused;
    return system_->Solve(damping, Eigen::VectorXd::Zero(layout_.size), &unused) &&
           system_->SolveAgain(Eigen::VectorXd::Ones(layout_.size)).allFinite();
  }

  int num_unknowns() const { return layout_.size; }
  double NoisePx() const { return std::sqrt(squared_residuals_ / redundancy_); }

  // S^-1 J' d, of which J is the derivative of the centres by the unknowns. `d`: 3 rows a pose.
  Eigen::VectorXd Solve(const Eigen::VectorXd& d) const {
    Eigen::VectorXd x = Eigen::VectorXd::Zero(layout_.size);
    for (size_t i = 0; i < bundle_.poses.size(); ++i) {
      x.segment<3>(layout_.pose_row[i] + 3) = bundle_.poses[i].R * d.segment<3>(3 * i);
    }
    return system_->SolveAgain(x);
  }
  // J x. Of Solve's: d times the centres' covariance for noise of 1 px, in this gauge.
  Eigen::VectorXd Displacements(const Eigen::VectorXd& x) const {
    Eigen::VectorXd d(3 * bundle_.poses.size());
    for (size_t i = 0; i < bundle_.poses.size(); ++i) {
      d.segment<3>(3 * i) = bundle_.poses[i].R.transpose() * x.segment<3>(layout_.pose_row[i] + 3);
    }
    return d;
  }

  // Variances of the centres' coordinates along some directions, summed, with the residuals of a
  // photo as one draw. `X`: a column for each direction, Solve's.
  double SumVariances(const Eigen::MatrixXd& X) const {
    const std::vector<PointRange> ranges = SplitPoints(bundle_);
    // Score of each pose's residuals along each direction.
    std::vector<Eigen::MatrixXd> scores(ranges.size(),
                                        Eigen::MatrixXd::Zero(bundle_.poses.size(), X.cols()));
    ForEachOnThreads(num_threads_, ranges.size(), [&](size_t i) {
      PointTerms terms;
      for (int p = ranges[i].begin; p < ranges[i].end; ++p) {
        ForEachPiece(bundle_.points[p], &terms, [&] { AddScores(X, &terms, &scores[i]); });
      }
    });
    for (size_t i = 1; i < scores.size(); ++i) scores[0] += scores[i];
    return scores[0].squaredNorm();
  }

 private:
  // A part of the points.
  struct Part {
    std::unique_ptr<ExplicitSystem> system;
    double squared_residuals = 0;
    double redundancy = 0;
  };

  void SumUpPoints() {
    const PosePattern pattern = ChoosePattern(BundleOptions(), bundle_, layout_);
    const std::vector<PointRange> ranges = SplitPoints(bundle_);
    std::vector<Part> parts(ranges.size());
    for (Part& part : parts) part.system = MakeSystem(pattern, layout_, num_threads_);
    ForEachOnThreads(num_threads_, parts.size(), [&](size_t i) {
      parts[i].system->SetZero();
      PointTerms terms;
      for (int p = ranges[i].begin; p < ranges[i].end; ++p) {
        AddPoint(bundle_.points[p], &terms, &parts[i]);
      }
    });
    system_ = std::move(parts[0].system);
    for (size_t i = 0; i < parts.size(); ++i) {
      if (i > 0) system_->Add(*parts[i].system);
      squared_residuals_ += parts[i].squared_residuals;
      redundancy_ += parts[i].redundancy;
    }
  }

  // Calls `use` with each piece of the point in `terms`.
  template <typename Use>
  void ForEachPiece(const BundlePoint& point, PointTerms* terms, const Use& use) const {
    const int num_pieces = NumPieces(point);
    for (int piece = 0; piece < num_pieces; ++piece) {
      terms->Set(bundle_, layout_, loss_, point, 0.0, piece, num_pieces);
      if (point.constant) {
        terms->V_inverse.setZero();
      } else if (!(terms->V.norm() * terms->V_inverse.norm() < kMaxConditionOfPoint)) {
        continue;
      }
      use();
    }
  }

  void AddPoint(const BundlePoint& point, PointTerms* terms, Part* part) const {
    ForEachPiece(point, terms, [&] {
      AddDirect(*terms, part->system.get());
      if (!point.constant) {
        terms->SetCouplings();
        AddSchurBlocks(*terms, &part->system->schur());
      }
      for (int i = 0; i < terms->size; ++i) {
        part->squared_residuals += terms->terms[i].residual.squaredNorm();
      }
      part->redundancy += 2 * terms->size;
    });
    if (!point.constant) part->redundancy -= 3;
  }

  // Each residual times what it changes by when the map moves along a direction and the point
  // follows.
  static void AddScores(const Eigen::MatrixXd& X, PointTerms* point, Eigen::MatrixXd* scores) {
    point->SetCouplings();
    Eigen::Matrix<double, 3, Eigen::Dynamic> pull =
        Eigen::Matrix<double, 3, Eigen::Dynamic>::Zero(3, X.cols());
    for (int i = 0; i < point->size; ++i) {
      pull += point->terms[i].W.transpose() * X.middleRows<6>(point->terms[i].pose_row);
    }
    for (const Coupling& c : point->couplings) {
      pull += c.W.topRows(c.size).transpose() * X.middleRows(c.row, c.size);
    }
    const Eigen::Matrix<double, 3, Eigen::Dynamic> follow = point->V_inverse * pull;
    for (int i = 0; i < point->size; ++i) {
      const ObservationTerm& term = point->terms[i];
      scores->row(term.pose) +=
          term.residual.transpose() * term.J_pose * X.middleRows<6>(term.pose_row);
      scores->row(term.pose) -= term.residual.transpose() * term.J_point * follow;
      if (term.camera_row < 0) continue;
      scores->row(term.pose) += term.residual.transpose() *
                                term.J_camera.leftCols(term.camera_size) *
                                X.middleRows(term.camera_row, term.camera_size);
    }
  }

  void AddPriors() {
    redundancy_ -= layout_.size - 7;
    if (redundancy_ <= 0) return;
    for (size_t i = 0; i < bundle_.cameras.size(); ++i) {
      const BundleCamera& camera = bundle_.cameras[i];
      for (size_t k = 0; k < camera.refined.size(); ++k) {
        system_->camera_block(layout_.camera_row[i], layout_.camera_size[i])(k, k) +=
            PriorInformation(camera, camera.refined[k]);
      }
    }
  }

  // Holds the pose with most information, and the distance of the pose farthest from it. Which
  // poses does not matter, as long as these are seven independent conditions.
  Eigen::VectorXd HoldGauge() {
    const auto information = [this](int i) {
      return system_->pose_block(layout_.pose_row[i]).diagonal().tail<3>().sum();
    };
    int held = 0, far = 0;
    for (size_t i = 0; i < centers_.size(); ++i) {
      if (information(static_cast<int>(i)) > information(held)) held = static_cast<int>(i);
    }
    const auto distance = [&](int i) { return (centers_[i] - centers_[held]).norm(); };
    for (size_t i = 0; i < centers_.size(); ++i) {
      if (distance(static_cast<int>(i)) > distance(far)) far = static_cast<int>(i);
    }
    Eigen::VectorXd damping = Eigen::VectorXd::Zero(layout_.size);
    damping.segment<6>(layout_.pose_row[held]) =
        system_->pose_block(layout_.pose_row[held]).diagonal();
    Eigen::Matrix<double, 6, 1> condition = Eigen::Matrix<double, 6, 1>::Zero();
    condition.tail<3>() = bundle_.poses[far].R * (centers_[far] - centers_[held]).normalized();
    system_->pose_block(layout_.pose_row[far]) +=
        information(far) * condition * condition.transpose();
    return damping;
  }

  const Bundle& bundle_;
  const BundleLayout layout_;
  const Centers centers_;
  const int num_threads_;
  const RobustLoss loss_{BundleOptions().loss, BundleOptions().loss_scale_px};
  std::unique_ptr<ExplicitSystem> system_;
  double squared_residuals_ = 0;
  double redundancy_ = 0;
};

// Displacements of centres, 3 rows each, with the best similarity taken out.
Eigen::VectorXd WithoutSimilarity(const Similarities& similarities, Eigen::VectorXd d) {
  SimilarityFit fit;
  const int num = static_cast<int>(d.size() / 3);
  for (int i = 0; i < num; ++i) fit.Add(similarities.Basis(i), d.segment<3>(3 * i));
  const Vector7d x = fit.Solve();
  for (int i = 0; i < num; ++i) d.segment<3>(3 * i) -= similarities.Basis(i) * x;
  return d;
}

// The covariance of the centres with similarities taken out.
struct Spectrum {
  Eigen::VectorXd values;     // its largest eigenvalues, ascending: nearly all if they fall off
  Eigen::MatrixXd vectors;    // a column for each
  Eigen::MatrixXd solutions;  // ReducedCovariance::Solve of each
};

// Lanczos iterations with full reorthogonalisation.
Spectrum FindSpectrum(const ReducedCovariance& covariance, const Similarities& similarities,
                      int size) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Eigen::VectorXd q(size);
  for (double& value : q) value = normal(random);
  q = WithoutSimilarity(similarities, q);
  Eigen::MatrixXd basis(size, kLanczosIterations);
  Eigen::MatrixXd solutions(covariance.num_unknowns(), kLanczosIterations);
  Eigen::MatrixXd T = Eigen::MatrixXd::Zero(kLanczosIterations, kLanczosIterations);
  int num = 0;
  while (num < kLanczosIterations && q.norm() > kNothingLeft * T(0, 0)) {
    const int k = num++;
    basis.col(k) = q.normalized();
    solutions.col(k) = covariance.Solve(basis.col(k));
    q = WithoutSimilarity(similarities, covariance.Displacements(solutions.col(k)));
    T(k, k) = basis.col(k).dot(q);
    for (int pass = 0; pass < 2; ++pass) {
      for (int i = 0; i < num; ++i) q -= basis.col(i).dot(q) * basis.col(i);
    }
    if (num < kLanczosIterations) T(num, k) = q.norm();
  }
  if (num == 0) return {};
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(T.topLeftCorner(num, num));
  return {eigen.eigenvalues(), basis.leftCols(num) * eigen.eigenvectors(),
          solutions.leftCols(num) * eigen.eigenvectors()};
}

// Points that two poses observe.
struct NumShared {
  int all = 0;
  int of_three = 0;  // that are seen from three directions
};

using IsOfSide = std::vector<bool>;  // of each pose

// Whether the poses of a side, or all, see the point from `num` directions. Copies and bursts of
// one photo count as one.
bool IsSeenFrom(size_t num, const Bundle& bundle, const Centers& centers, const BundlePoint& point,
                const IsOfSide& side = {}) {
  const double max_cosine = std::cos(DegToRad(kSameDirectionDeg));
  std::vector<Eigen::Vector3d> directions;
  for (int i = point.first; i < point.first + point.count && directions.size() < num; ++i) {
    const int pose = bundle.observations[i].pose;
    if (!side.empty() && !side[pose]) continue;
    const Eigen::Vector3d direction = (centers[pose] - point.xyz).normalized();
    const bool is_new = std::all_of(directions.begin(), directions.end(), [&](const auto& other) {
      return other.dot(direction) < max_cosine;
    });
    if (is_new) directions.push_back(direction);
  }
  return directions.size() == num;
}

// For each pose the others that share points with it.
std::vector<std::vector<std::pair<int, NumShared>>> SharedPoints(const Bundle& bundle) {
  const size_t num = bundle.poses.size();
  const Centers centers = CentersOf(bundle);
  std::vector<std::vector<std::pair<const BundlePoint*, bool>>> points_of(num);
  for (const BundlePoint& point : bundle.points) {
    const bool is_of_three = IsSeenFrom(3, bundle, centers, point);
    for (int i = point.first; i < point.first + point.count; ++i) {
      points_of[bundle.observations[i].pose].emplace_back(&point, is_of_three);
    }
  }
  std::vector<std::vector<std::pair<int, NumShared>>> shared(num);
  std::vector<NumShared> counts(num);
  for (size_t a = 0; a < num; ++a) {
    for (const auto& [point, is_of_three] : points_of[a]) {
      for (int i = point->first; i < point->first + point->count; ++i) {
        NumShared& count = counts[bundle.observations[i].pose];
        ++count.all;
        count.of_three += is_of_three;
      }
    }
    for (size_t b = 0; b < num; ++b) {
      const NumShared count = std::exchange(counts[b], {});
      if (count.all > 0 && b != a) shared[a].emplace_back(static_cast<int>(b), count);
    }
  }
  return shared;
}

// `top` and the poses below it.
IsOfSide PosesBelow(const SpanningTree& tree, int top) {
  IsOfSide is_below(tree.order.size(), false);
  for (const int i : tree.order) {
    is_below[i] = i == top || (tree.parent[i] >= 0 && is_below[tree.parent[i]]);
  }
  return is_below;
}

// Points that both sides observe, from three directions.
int CountTyingPoints(const Bundle& bundle, const Centers& centers, const IsOfSide& below,
                     const IsOfSide& above) {
  return static_cast<int>(
      std::count_if(bundle.points.begin(), bundle.points.end(), [&](const BundlePoint& point) {
        return IsSeenFrom(1, bundle, centers, point, below) &&
               IsSeenFrom(1, bundle, centers, point, above) &&
               IsSeenFrom(3, bundle, centers, point);
      }));
}

// Whether the side alone sees so many points from two directions.
bool HasScale(int min_points, const Bundle& bundle, const Centers& centers, const IsOfSide& side) {
  int num_points = 0;
  for (const BundlePoint& point : bundle.points) {
    num_points += IsSeenFrom(2, bundle, centers, point, side);
    if (num_points >= min_points) return true;
  }
  return false;
}

}  // namespace

std::optional<LoosestMode> FindLoosestMode(const Bundle& bundle, int num_threads) {
  if (bundle.poses.size() < 3) return std::nullopt;
  ReducedCovariance covariance(bundle, num_threads);
  if (!covariance.Decompose()) return std::nullopt;
  const int num = static_cast<int>(bundle.poses.size());
  const Spectrum spectrum = FindSpectrum(covariance, Similarities(CentersOf(bundle)), 3 * num);
  LoosestMode mode;
  mode.noise_px = covariance.NoisePx();
  mode.displacements.assign(num, Eigen::Vector3d::Zero());
  if (spectrum.values.size() == 0) return mode;
  const double length = mode.noise_px * std::sqrt(spectrum.values.tail<1>().value());
  mode.sigma = length / std::sqrt(num);
  const double independent = mode.noise_px * mode.noise_px * spectrum.values.sum();
  mode.expected_error =
      std::sqrt(std::max(independent, covariance.SumVariances(spectrum.solutions)) / num);
  if (!std::isfinite(mode.expected_error)) return std::nullopt;
  for (int i = 0; i < num; ++i) {
    mode.displacements[i] =
        length * spectrum.vectors.col(spectrum.vectors.cols() - 1).segment<3>(3 * i);
  }
  return mode;
}

SpanningTree MaximumSpanningTree(const Bundle& bundle) {
  const int num = static_cast<int>(bundle.poses.size());
  const auto edges = SharedPoints(bundle);
  SpanningTree tree{{}, std::vector<int>(num, -1), {}};
  std::vector<NumShared> best(num);
  std::vector<bool> is_in(num, false);
  for (int k = 0; k < num; ++k) {
    int next = -1;
    for (int i = 0; i < num; ++i) {
      if (!is_in[i] && (next < 0 || best[i].all > best[next].all)) next = i;
    }
    if (k > 0 && tree.parent[next] < 0) tree.parent[next] = tree.order.front();
    is_in[next] = true;
    tree.order.push_back(next);
    for (const auto& [other, count] : edges[next]) {
      if (is_in[other] || count.all <= best[other].all) continue;
      best[other] = count;
      tree.parent[other] = next;
    }
  }
  for (const NumShared& count : best) tree.shared.push_back(count.of_three);
  return tree;
}

WeakestCut FindWeakestCut(const Bundle& bundle, const SpanningTree& tree,
                          const std::vector<Eigen::Vector3d>& displacements) {
  const int num = static_cast<int>(bundle.poses.size());
  const Similarities similarities(CentersOf(bundle));
  std::vector<SimilarityFit> fits(num);  // of each pose with all below it
  SimilarityFit whole;
  double squared = 0;
  for (int i = 0; i < num; ++i) {
    fits[i].Add(similarities.Basis(i), displacements[i]);
    whole.Add(fits[i]);
    squared += displacements[i].squaredNorm();
  }
  WeakestCut cut;
  for (auto i = tree.order.rbegin(); i != tree.order.rend(); ++i) {
    const int parent = tree.parent[*i];
    if (parent < 0) continue;
    const SimilarityFit& below = fits[*i];
    const SimilarityFit above{whole.N - below.N, whole.b - below.b, num - below.num};
    const double share = squared > 0 ? (below.Explained() + above.Explained()) / squared : 0;
    if (share > cut.explained_share) {
      const bool is_below_loose = below.num <= above.num;
      cut = {is_below_loose ? *i : parent, is_below_loose ? parent : *i,
             std::min(below.num, above.num), share};
    }
    fits[parent].Add(below);
  }
  return cut;
}

std::optional<ThinnestCut> FindThinnestCut(const Bundle& bundle, const SpanningTree& tree,
                                           int min_points) {
  const auto num = static_cast<int>(bundle.poses.size());
  const Centers centers = CentersOf(bundle);
  std::optional<ThinnestCut> thinnest;
  for (const int i : tree.order) {
    const int parent = tree.parent[i];
    if (parent < 0 || tree.shared[i] >= min_points) continue;
    const IsOfSide below = PosesBelow(tree, i);
    IsOfSide above = below;
    above.flip();
    if (!HasScale(min_points, bundle, centers, below) ||
        !HasScale(min_points, bundle, centers, above)) {
      continue;
    }
    const int num_points = CountTyingPoints(bundle, centers, below, above);
    if (num_points >= (thinnest ? thinnest->num_points : min_points)) continue;
    const bool is_below_loose = 2 * std::count(below.begin(), below.end(), true) <= num;
    thinnest = {is_below_loose ? i : parent, is_below_loose ? parent : i, {}, num_points};
    for (int k = 0; k < num; ++k) {
      if (below[k] == is_below_loose) thinnest->loose_side.push_back(k);
    }
  }
  return thinnest;
}

double ExtentOf(const Bundle& bundle) {
  const Centers centers = CentersOf(bundle);
  double squared = 0;
  for (size_t i = 0; i < centers.size(); ++i) {
    for (size_t k = 0; k < i; ++k) {
      squared = std::max(squared, (centers[i] - centers[k]).squaredNorm());
    }
  }
  return std::sqrt(squared);
}

}  // namespace skein
