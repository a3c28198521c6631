#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "bundle/bundle.h"
#include "bundle/bundle_terms.h"
#include "bundle/reduced_system.h"

namespace skein {

// Least diagonal entry that damping counts with.
constexpr double kMinDiagonal = 1e-6;

// Observations of a point that are eliminated together where that need not be exact. A track of m
// times as many counts as m points: of its 2 L - 3 pieces of information 2 L - 3 m are left, at
// 1 / m of the products.
constexpr int kPieceLength = 32;
inline int NumPieces(const BundlePoint& point) { return std::max(1, point.count / kPieceLength); }

// A row block of W, the coupling of a pose or a camera with a point.
struct Coupling {
  Coupling(int row, int size) : row(row), size(size) {}
  int row, size;
  Eigen::Matrix<double, kMaxIntrinsics, 3> W = Eigen::Matrix<double, kMaxIntrinsics, 3>::Zero();
};

// A point's linearised observations and its own block of the normal equations.
struct PointTerms {
  std::vector<ObservationTerm> terms;  // the first `size` count
  int size = 0;
  Eigen::Matrix3d V = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  Eigen::Vector3d damping = Eigen::Vector3d::Zero();  // added to the diagonal of V
  Eigen::Matrix3d V_inverse = Eigen::Matrix3d::Zero();
  // With each camera's parameters, summed over the point's observations by that camera.
  std::vector<Coupling> couplings;

  // With each `stride`-th observation from `from` on; those behind the camera are left out.
  void Set(const Bundle& bundle, const BundleLayout& layout, const RobustLoss& loss,
           const BundlePoint& point, double lambda, int from = 0, int stride = 1);
  // To be called before the couplings are read.
  void SetCouplings();
};

// Adds the cameras' part of the observations to U and its right-hand side.
void AddDirect(const PointTerms& point, ReducedSystem* system);

// Adds W V^-1 J_p' r to the right-hand side. The couplings are set.
void AddSchurGradient(const PointTerms& point, ReducedSystem* system);

// Adds W V^-1 W' to what the points take out of U. The couplings are set.
void AddSchurBlocks(const PointTerms& point, SchurBlocks* schur);

}  // namespace skein
