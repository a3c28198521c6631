#include "bundle/conjugate_gradients.h"

namespace skein {
namespace {

// Part of the step's error that may be left, in the norm of the preconditioned system. The next
// step of Levenberg-Marquardt makes up for it.
constexpr double kTolerance = 1e-2;
constexpr int kMaxIterations = 40;

}  // namespace

Eigen::VectorXd ConjugateGradients::Multiply(const Eigen::VectorXd& damping,
                                             const Eigen::VectorXd& x) const {
  std::vector<Eigen::VectorXd> products(points.size(), Eigen::VectorXd::Zero(x.size()));
  for_each([&](size_t i) { points[i].SubtractSchurProduct(x, &products[i]); });
  Eigen::VectorXd y = damping.cwiseProduct(x);
  direct.AddProduct(x, &y);
  for (const Eigen::VectorXd& product : products) y += product;
  return y;
}

Eigen::VectorXd ConjugateGradients::Precondition(const Eigen::VectorXd& diagonal,
                                                 const Eigen::VectorXd& r) const {
  Eigen::VectorXd known = Eigen::VectorXd::Zero(factor.size());
  for (int i = 0; i < r.size(); ++i) {
    if (factor_rows[i] >= 0) known[factor_rows[i]] = r[i];
  }
  known = factor.Apply(known);
  Eigen::VectorXd z(r.size());
  for (int i = 0; i < r.size(); ++i) {
    z[i] = factor_rows[i] >= 0 ? known[factor_rows[i]] : r[i] / diagonal[i];
  }
  return z;
}

bool ConjugateGradients::Solve(const Eigen::VectorXd& damping, const Eigen::VectorXd& b,
                               Eigen::VectorXd* x) const {
  const Eigen::VectorXd diagonal = direct.Diagonal() + damping;
  x->setZero(b.size());
  Eigen::VectorXd r = b;
  Eigen::VectorXd z = Precondition(diagonal, r);
  Eigen::VectorXd p = z;
  double rz = r.dot(z);
  const double enough = kTolerance * kTolerance * rz;
  for (int i = 0; i < kMaxIterations && rz > enough; ++i) {
    const Eigen::VectorXd Sp = Multiply(damping, p);
    const double curvature = p.dot(Sp);
    if (!(curvature > 0)) return false;
    const double step = rz / curvature;
    *x += step * p;
    r -= step * Sp;
    z = Precondition(diagonal, r);
    const double next = r.dot(z);
    p = z + next / rz * p;
    rz = next;
  }
  return rz <= enough && x->allFinite();
}

}  // namespace skein
