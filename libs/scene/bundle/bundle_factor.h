#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "bundle/bundle.h"
#include "bundle/bundle_terms.h"
#include "bundle/reduced_system.h"

namespace skein {

// A decomposed reduced system, with the images and cameras of its rows. As a preconditioner it
// serves later bundles, too, of which it knows most poses. Immutable, so threads may share it.
class BundleFactor {
 public:
  // `system` was solved.
  BundleFactor(const Bundle& bundle, const BundleLayout& layout,
               std::unique_ptr<ExplicitSystem> system);

  int size() const { return size_; }
  // For each row of `layout` the row of the factor; -1 if the factor does not know the pose or
  // camera.
  std::vector<int> RowsOf(const Bundle& bundle, const BundleLayout& layout) const;
  // Solves with the decomposed matrix.
  Eigen::VectorXd Apply(const Eigen::VectorXd& b) const { return system_->SolveAgain(b); }

 private:
  struct CameraRows {
    int row = 0;
    std::vector<int> refined;
  };
  std::unordered_map<uint32_t, int> row_of_image_;
  std::unordered_map<uint32_t, CameraRows> rows_of_camera_;
  const int size_;
  const std::unique_ptr<ExplicitSystem> system_;
};

}  // namespace skein
