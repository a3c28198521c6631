#include "geometry/rotation_averaging.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <numeric>
#include <set>

#include "core/angles.h"
#include "core/disjoint_sets.h"

namespace skein {
namespace {

using Rotations = std::map<uint32_t, Eigen::Matrix3d>;

constexpr double kGemanMcClureRad = DegToRad(5);

Eigen::Vector3d Log(const Eigen::Matrix3d& R) {
  const Eigen::AngleAxisd rotation(R);
  return rotation.angle() * rotation.axis();
}

Eigen::Matrix3d Exp(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  if (angle < 1e-12) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
}

// R2 exp(error) = R R1, with R of the pair.
Eigen::Vector3d Error(const RelativeRotation& pair, const Rotations& rotations) {
  return Log(rotations.at(pair.id2).transpose() * pair.R * rotations.at(pair.id1));
}

std::vector<size_t> StrongestFirst(const std::vector<RelativeRotation>& pairs) {
  std::vector<size_t> order(pairs.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return pairs[a].weight > pairs[b].weight; });
  return order;
}

// Along a maximum spanning tree of the pairs, each component from its own first photo.
Rotations AlongTree(const std::vector<RelativeRotation>& pairs) {
  DisjointSets<uint32_t> sets;
  std::map<uint32_t, std::vector<std::pair<uint32_t, Eigen::Matrix3d>>> tree;
  for (const size_t i : StrongestFirst(pairs)) {
    const RelativeRotation& pair = pairs[i];
    if (sets.Find(pair.id1) == sets.Find(pair.id2)) continue;
    sets.Join(pair.id1, pair.id2);
    tree[pair.id1].emplace_back(pair.id2, pair.R);
    tree[pair.id2].emplace_back(pair.id1, pair.R.transpose());
  }
  Rotations rotations;
  for (const auto& [root, unused] : tree) {
    if (!rotations.emplace(root, Eigen::Matrix3d::Identity()).second) continue;
    std::vector<uint32_t> open = {root};
    while (!open.empty()) {
      const uint32_t id = open.back();
      open.pop_back();
      for (const auto& [other, R] : tree.at(id)) {
        if (rotations.emplace(other, R * rotations.at(id)).second) open.push_back(other);
      }
    }
  }
  return rotations;
}

// The largest connected component of the pairs that `is_used`.
std::set<uint32_t> LargestComponent(const std::vector<RelativeRotation>& pairs,
                                    const std::vector<bool>& is_used) {
  DisjointSets<uint32_t> sets;
  for (size_t i = 0; i < pairs.size(); ++i) {
    if (is_used[i]) sets.Join(pairs[i].id1, pairs[i].id2);
  }
  std::map<uint32_t, std::set<uint32_t>> components;
  for (const auto& [id, representative] : sets.Representatives())
    components[representative].insert(id);
  std::set<uint32_t> largest;
  for (const auto& [unused, ids] : components) {
    if (ids.size() > largest.size()) largest = ids;
  }
  return largest;
}

void KeepLargestComponent(std::vector<RelativeRotation>* pairs) {
  const std::set<uint32_t> largest =
      LargestComponent(*pairs, std::vector<bool>(pairs->size(), true));
  pairs->erase(std::remove_if(pairs->begin(), pairs->end(),
                              [&](const auto& pair) { return largest.count(pair.id1) == 0; }),
               pairs->end());
}

using WeightOf = double (*)(const RelativeRotation& pair, double error_rad);

// One step of weighted least squares; returns the largest change of a rotation, rad. The first
// photo is held.
double AverageStep(const std::vector<RelativeRotation>& pairs, WeightOf weight_of,
                   Rotations* rotations) {
  std::map<uint32_t, int> index;
  for (const auto& [id, unused] : *rotations) index.emplace(id, static_cast<int>(index.size()) - 1);
  const int n = static_cast<int>(index.size()) - 1;
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixX3d right = Eigen::MatrixX3d::Zero(n, 3);
  for (const RelativeRotation& pair : pairs) {
    const Eigen::Vector3d error = Error(pair, *rotations);
    const double w = weight_of(pair, error.norm());
    const int i = index.at(pair.id1), j = index.at(pair.id2);
    if (i >= 0) {
      entries.emplace_back(i, i, w);
      right.row(i) -= w * error.transpose();
    }
    if (j >= 0) {
      entries.emplace_back(j, j, w);
      right.row(j) += w * error.transpose();
    }
    if (i >= 0 && j >= 0) {
      entries.emplace_back(i, j, -w);
      entries.emplace_back(j, i, -w);
    }
  }
  Eigen::SparseMatrix<double> laplacian(n, n);
  laplacian.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(laplacian);
  if (solver.info() != Eigen::Success) return 0;
  const Eigen::MatrixX3d step = solver.solve(right);
  if (!step.allFinite()) return 0;
  double largest = 0;
  for (auto& [id, R] : *rotations) {
    const int i = index.at(id);
    if (i < 0) continue;
    R = R * Exp(step.row(i).transpose());
    largest = std::max(largest, step.row(i).norm());
  }
  return largest;
}

double WeightOfL1(const RelativeRotation&, double error_rad) {
  return 1 / std::max(error_rad, 1e-4);
}

double WeightOfGemanMcClure(const RelativeRotation& pair, double error_rad) {
  const double s = kGemanMcClureRad * kGemanMcClureRad;
  const double sum = error_rad * error_rad + s;
  return pair.weight * s * s / (sum * sum);
}

double GemanMcClureCost(const std::vector<RelativeRotation>& pairs, const Rotations& rotations) {
  double cost = 0;
  for (const RelativeRotation& pair : pairs) {
    const double squared = Error(pair, rotations).squaredNorm();
    cost += pair.weight * squared / (squared + kGemanMcClureRad * kGemanMcClureRad);
  }
  return cost;
}

void Average(const std::vector<RelativeRotation>& pairs, WeightOf weight_of, Rotations* rotations) {
  constexpr int kMaxSteps = 100;
  constexpr double kMinStepRad = 1e-3;
  for (int i = 0; i < kMaxSteps; ++i) {
    if (AverageStep(pairs, weight_of, rotations) < kMinStepRad) break;
  }
}

}  // namespace

RotationAveraging AverageRotations(const std::vector<RelativeRotation>& all, double max_error_deg) {
  RotationAveraging result;
  result.fits.resize(all.size());
  std::vector<RelativeRotation> pairs = all;
  KeepLargestComponent(&pairs);
  if (pairs.empty()) return result;
  Rotations rotations = AlongTree(pairs), by_l1 = rotations;
  Average(pairs, WeightOfGemanMcClure, &rotations);
  Average(pairs, WeightOfL1, &by_l1);
  Average(pairs, WeightOfGemanMcClure, &by_l1);
  if (GemanMcClureCost(pairs, by_l1) < GemanMcClureCost(pairs, rotations)) rotations = by_l1;
  for (size_t i = 0; i < all.size(); ++i) {
    result.fits[i] = rotations.count(all[i].id1) > 0 &&
                     Error(all[i], rotations).norm() <= DegToRad(max_error_deg);
  }
  const std::set<uint32_t> largest = LargestComponent(all, result.fits);
  for (const uint32_t id : largest) result.rotations[id] = rotations.at(id);
  for (size_t i = 0; i < all.size(); ++i)
    result.fits[i] = result.fits[i] && largest.count(all[i].id1) > 0;
  return result;
}

}  // namespace skein
