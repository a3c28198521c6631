#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <vector>

#include "bundle/bundle_factor.h"
#include "bundle/bundle_terms.h"
#include "bundle/reduced_system.h"

namespace skein {

// A row block of W, the coupling of a pose or a camera with a point.
struct Coupling {
  Coupling(int row, int size) : row(row), size(size) {}
  int row, size;
  Eigen::Matrix<double, kMaxIntrinsics, 3> W = Eigen::Matrix<double, kMaxIntrinsics, 3>::Zero();
};

// The reduced system as a product with vectors: S x = U x - W V^-1 W' x. A product costs as much as
// there are observations. The matrix costs the sum of the squared track lengths.
class ImplicitSystem : public ReducedSystem {
 public:
  ImplicitSystem(const Bundle& bundle, const BundleLayout& layout);

  // The points' part, one point after the other: its couplings with poses, then with cameras.
  void KeepPose(int row, const Eigen::Matrix<double, 6, 3>& W);
  void KeepCamera(const Coupling& coupling) { cameras_.push_back(coupling); }
  void EndPoint(const Eigen::Matrix3d& V_inverse);

  // y += U x
  void AddDirectProduct(const Eigen::VectorXd& x, Eigen::VectorXd* y) const;
  // y -= W V^-1 W' x
  void SubtractSchurProduct(const Eigen::VectorXd& x, Eigen::VectorXd* y) const;

 protected:
  void Add(int row, int column, const double* values, int rows, int columns, double sign) override;
  void SetMatrixZero() override;
  void AddMatrix(const ReducedSystem& other) override;

 private:
  struct KeptPoint {
    size_t poses_end, cameras_end;
    Eigen::Matrix3d V_inverse;
  };

  struct Rows {
    int first = 0, size = 0;  // none: size 0
  };
  static Rows RowsOf(const Bundle& bundle, const BundleLayout& layout, int camera);

  const int num_pose_rows_;
  // U: of each pose and camera the block on the diagonal, at its columns, and that of each pose
  // with its camera.
  Eigen::MatrixXd blocks_;
  std::vector<Eigen::Matrix<double, 6, kMaxIntrinsics>> cross_;
  std::vector<Rows> camera_of_pose_;
  std::vector<Rows> camera_of_row_;  // from the first camera's row on
  // Blocks that couple the points with poses and cameras.
  std::vector<Eigen::Matrix<double, 6, 3>> poses_;
  std::vector<int> pose_rows_;
  std::vector<Coupling> cameras_;
  std::vector<KeptPoint> points_;
};

// Conjugate gradients for (S + diag(damping)) x = b, S the sum of the parts: of their direct ones
// only the first counts. Rows that the factor does not know are preconditioned by U's diagonal.
// `for_each`: calls a function for each part, in threads. Returns false if the error has not
// fallen enough in time: the factor is of another system then.
struct ConjugateGradients {
  const std::vector<std::unique_ptr<ImplicitSystem>>& parts;
  const BundleFactor& factor;
  const std::vector<int>& factor_rows;
  std::function<void(const std::function<void(size_t)>&)> for_each;

  bool Solve(const Eigen::VectorXd& damping, const Eigen::VectorXd& b, Eigen::VectorXd* x) const;

 private:
  Eigen::VectorXd Multiply(const Eigen::VectorXd& damping, const Eigen::VectorXd& x) const;
  Eigen::VectorXd Precondition(const Eigen::VectorXd& damping, const Eigen::VectorXd& r) const;
};

}  // namespace skein
