#include "sfm/five_point.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "sfm/colmap_api.h"

namespace skein {
namespace {

constexpr int kDegree = 10;
using Polynomial = std::array<double, kDegree + 1>;  // lowest power first

double ValueAt(const Polynomial& polynomial, int degree, double z) {
  double value = polynomial[degree];
  for (int i = degree - 1; i >= 0; --i) value = value * z + polynomial[i];
  return value;
}

// The root between `low` and `high`, where f rises or falls through zero, by Newton's method, and
// by bisection where that would leave the interval.
double RootBetween(const Polynomial& f, const Polynomial& derivative, double low, double high,
                   bool rises) {
  constexpr int kMaxSteps = 60;
  constexpr double kTolerance = 1e-14;
  double z = (low + high) / 2;
  for (int step = 0; step < kMaxSteps; ++step) {
    const double value = ValueAt(f, kDegree, z);
    ((value < 0) == rises ? low : high) = z;
    double next = z - value / ValueAt(derivative, kDegree - 1, z);
    if (!(next > low && next < high)) next = (low + high) / 2;
    if (std::abs(next - z) < kTolerance) return next;
    z = next;
  }
  return z;
}

// A polynomial over an interval by its Bernstein coefficients: the first and the last are its
// values at the ends.
struct Piece {
  Polynomial bernstein;
  double low, high;
};

// Rows: Bernstein coefficients over (-1, 1) of the powers. That of x^i and index j is the blossom
// of x^i at j times 1 and else -1: of (1 + y)^j (1 - y)^(n - j) the coefficient of y^i over n
// choose i.
Eigen::Matrix<double, kDegree + 1, kDegree + 1> BernsteinOfPowers() {
  Eigen::Matrix<double, kDegree + 1, kDegree + 1> of_powers;
  Polynomial binomial{};
  for (int j = kDegree; j >= 0; --j) {
    Polynomial product{1};
    for (int k = 0; k < kDegree; ++k) {
      for (int i = k + 1; i > 0; --i) product[i] += (k < j ? 1 : -1) * product[i - 1];
    }
    if (j == kDegree) binomial = product;
    for (int i = 0; i <= kDegree; ++i) of_powers(j, i) = product[i] / binomial[i];
  }
  return of_powers;
}

// Of the coefficients that are not zero.
struct Signs {
  int changes = 0;
  bool ends_positive = false;
};

Signs SignsOf(const Polynomial& coefficients) {
  Signs signs;
  bool any = false;
  for (const double value : coefficients) {
    if (value == 0) continue;
    signs.changes += any && signs.ends_positive != (value > 0);
    signs.ends_positive = value > 0;
    any = true;
  }
  return signs;
}

// De Casteljau: `piece` becomes its right half.
Piece SplitLeft(Piece* piece) {
  Piece left{{}, piece->low, (piece->low + piece->high) / 2};
  Polynomial& b = piece->bernstein;
  for (int k = 0; k <= kDegree; ++k) {
    left.bernstein[k] = b[0];
    for (int i = 0; i < kDegree - k; ++i) b[i] = (b[i] + b[i + 1]) / 2;
  }
  piece->low = left.high;
  return left;
}

// Roots in (-1, 1). A piece has at most as many as its coefficients change sign, and one if they do
// so once.
std::vector<double> RootsWithinOne(const Polynomial& polynomial) {
  constexpr double kMinWidth = 1e-8;  // two roots as near as that are one up to rounding
  static const Eigen::Matrix<double, kDegree + 1, kDegree + 1> of_powers = BernsteinOfPowers();
  Polynomial derivative{};
  for (int i = 0; i < kDegree; ++i) derivative[i] = (i + 1) * polynomial[i + 1];
  std::vector<Piece> pieces(1, {{}, -1, 1});
  Eigen::Map<Eigen::Matrix<double, kDegree + 1, 1>>(pieces[0].bernstein.data()) =
      of_powers * Eigen::Map<const Eigen::Matrix<double, kDegree + 1, 1>>(polynomial.data());
  std::vector<double> roots;
  while (!pieces.empty()) {
    Piece& piece = pieces.back();
    const Signs signs = SignsOf(piece.bernstein);
    if (signs.changes > 1 && piece.high - piece.low > kMinWidth) {
      const Piece left = SplitLeft(&piece);
      if (left.bernstein[kDegree] == 0) roots.push_back(left.high);
      pieces.push_back(left);
      continue;
    }
    if (signs.changes == 1) {
      roots.push_back(
          RootBetween(polynomial, derivative, piece.low, piece.high, signs.ends_positive));
    }
    pieces.pop_back();
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
#include SKEIN_ESSENTIAL_MATRIX_POLY
  const Eigen::Matrix<double, 13, 3> B =
      PolynomialsOf(A.leftCols<10>().partialPivLu().solve(A.rightCols<10>()));
  Eigen::Matrix<double, 11, 1> coeffs;
#include SKEIN_ESSENTIAL_MATRIX_COEFFS
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
