#include "matching/five_point.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "estimators/utils.h"

namespace skein {
namespace {

constexpr int kDegree = 10;
using Polynomial = std::array<double, kDegree + 1>;  // lowest power first

double ValueAt(const Polynomial& polynomial, int degree, double z) {
  double value = polynomial[degree];
  for (int i = degree - 1; i >= 0; --i) value = value * z + polynomial[i];
  return value;
}

// The root between `low` and `high`, where f has different signs, by Newton's method, and by
// bisection where that would leave the interval.
double RootBetween(const Polynomial& f, const Polynomial& derivative, int degree, double low,
                   double high) {
  constexpr int kMaxSteps = 60;
  constexpr double kTolerance = 1e-14;
  const bool rises = ValueAt(f, degree, low) < 0;
  double z = (low + high) / 2;
  for (int step = 0; step < kMaxSteps; ++step) {
    const double value = ValueAt(f, degree, z);
    ((value < 0) == rises ? low : high) = z;
    double next = z - value / ValueAt(derivative, degree - 1, z);
    if (!(next > low && next < high)) next = (low + high) / 2;
    if (std::abs(next - z) < kTolerance) return next;
    z = next;
  }
  return z;
}

// Roots in (-1, 1), ascending: of the derivatives first, from the linear one on.
std::vector<double> RootsWithinOne(const Polynomial& polynomial) {
  std::array<Polynomial, kDegree + 1> of_degree;
  of_degree[kDegree] = polynomial;
  for (int degree = kDegree; degree > 0; --degree) {
    for (int i = 0; i < degree; ++i) {
      of_degree[degree - 1][i] = (i + 1) * of_degree[degree][i + 1];
    }
  }
  std::vector<double> roots, ends;
  for (int degree = 1; degree <= kDegree; ++degree) {
    ends.assign(1, -1);
    ends.insert(ends.end(), roots.begin(), roots.end());
    ends.push_back(1);
    roots.clear();
    const Polynomial& f = of_degree[degree];
    for (size_t i = 0; i + 1 < ends.size(); ++i) {
      if (ValueAt(f, degree, ends[i]) * ValueAt(f, degree, ends[i + 1]) >= 0) continue;
      roots.push_back(RootBetween(f, of_degree[degree - 1], degree, ends[i], ends[i + 1]));
    }
  }
  return roots;
}

// Columns x, y, z, w: the essential matrices that the five points allow are their combinations.
Eigen::Matrix<double, 9, 4> NullSpace(const std::vector<Eigen::Vector2d>& points1,
                                      const std::vector<Eigen::Vector2d>& points2) {
  Eigen::Matrix<double, 9, 5> constraints;
  for (int i = 0; i < 5; ++i) {
    const Eigen::Vector3d x1 = points1[i].homogeneous(), x2 = points2[i].homogeneous();
    constraints.col(i) << x2.x() * x1, x2.y() * x1, x1;
  }
  const Eigen::HouseholderQR<Eigen::Matrix<double, 9, 5>> qr(constraints);
  Eigen::Matrix<double, 9, 4> null_space = Eigen::Matrix<double, 9, 4>::Zero();
  null_space.bottomRows<4>().setIdentity();
  null_space.applyOnTheLeft(qr.householderQ());
  return null_space;
}

// The vector that is orthogonal to all rows of a matrix of rank two.
Eigen::Vector3d Orthogonal(const Eigen::Matrix3d& rows) {
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d cross = rows.row(i).transpose().cross(rows.row((i + 1) % 3).transpose());
    if (cross.squaredNorm() > best.squaredNorm()) best = cross;
  }
  return best;
}

// Nister's equations (10) to (15): rows of B are polynomials in z, highest power first.
Eigen::Matrix<double, 13, 3> PolynomialsOf(const Eigen::Matrix<double, 10, 10>& eliminated) {
  Eigen::Matrix<double, 13, 3> B;
  for (int i = 0; i < 3; ++i) {
    const auto upper = eliminated.row(2 * i + 4), lower = eliminated.row(2 * i + 5);
    B.col(i).setZero();
    B.block<3, 1>(1, i) = upper.segment<3>(0);
    B.block<3, 1>(5, i) = upper.segment<3>(3);
    B.block<4, 1>(9, i) = upper.segment<4>(6);
    B.block<3, 1>(0, i) -= lower.segment<3>(0);
    B.block<3, 1>(4, i) -= lower.segment<3>(3);
    B.block<4, 1>(8, i) -= lower.segment<4>(6);
  }
  return B;
}

Eigen::Matrix3d ValueAt(const Eigen::Matrix<double, 13, 3>& B, double z) {
  Eigen::Matrix3d value;
  for (int j = 0; j < 3; ++j) {
    const auto b = B.col(j);
    value(j, 0) = ((b(0) * z + b(1)) * z + b(2)) * z + b(3);
    value(j, 1) = ((b(4) * z + b(5)) * z + b(6)) * z + b(7);
    value(j, 2) = (((b(8) * z + b(9)) * z + b(10)) * z + b(11)) * z + b(12);
  }
  return value;
}

}  // namespace

// |z| > 1 by the reversed polynomial, whose roots are 1 / z.
std::vector<double> RealRoots(const std::array<double, 11>& coefficients) {
  std::vector<double> roots = RootsWithinOne(coefficients);
  Polynomial reversed = coefficients;
  std::reverse(reversed.begin(), reversed.end());
  for (const double root : RootsWithinOne(reversed)) {
    if (root != 0) roots.push_back(1 / root);
  }
  return roots;
}

std::vector<Eigen::Matrix3d> FivePointEstimator::Estimate(
    const std::vector<Eigen::Vector2d>& points1, const std::vector<Eigen::Vector2d>& points2) {
  if (points1.size() != kMinNumSamples || points2.size() != kMinNumSamples) {
    throw std::invalid_argument("five points are wanted");
  }
  const Eigen::Matrix<double, 9, 4> E = NullSpace(points1, points2);
  // COLMAP's generated algebra: of E the 10 x 20 matrix A, of B the polynomial of degree 10,
  // highest power first.
  Eigen::Matrix<double, 10, 20> A;
#include "estimators/essential_matrix_poly.h"
  const Eigen::Matrix<double, 13, 3> B =
      PolynomialsOf(A.leftCols<10>().partialPivLu().solve(A.rightCols<10>()));
  Eigen::Matrix<double, 11, 1> coeffs;
#include "estimators/essential_matrix_coeffs.h"
  std::vector<Eigen::Matrix3d> models;
  if (!coeffs.allFinite()) return models;
  Polynomial polynomial;
  for (int i = 0; i <= kDegree; ++i) polynomial[i] = coeffs(kDegree - i);
  for (const double z : RealRoots(polynomial)) {
    constexpr double kMinShare = 1e-10;
    const Eigen::Vector3d xy = Orthogonal(ValueAt(B, z));
    if (!(std::abs(xy.z()) > kMinShare * xy.norm())) continue;
    const Eigen::Matrix<double, 9, 1> vector =
        (E * Eigen::Vector4d(xy.x() / xy.z(), xy.y() / xy.z(), z, 1)).normalized();
    models.push_back(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(vector.data()));
  }
  return models;
}

void FivePointEstimator::Residuals(const std::vector<Eigen::Vector2d>& points1,
                                   const std::vector<Eigen::Vector2d>& points2,
                                   const Eigen::Matrix3d& E, std::vector<double>* residuals) {
  colmap::ComputeSquaredSampsonError(points1, points2, E, residuals);
}

}  // namespace skein
