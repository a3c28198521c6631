#include "bundle/bundle_factor.h"

#include <utility>

namespace skein {

BundleFactor::BundleFactor(const Bundle& bundle, const BundleLayout& layout,
                           std::unique_ptr<ExplicitSystem> system)
    : size_(layout.size), system_(std::move(system)) {
  system_->DropMatrix();
  for (size_t i = 0; i < bundle.poses.size(); ++i) {
    if (layout.pose_row[i] >= 0) row_of_image_[bundle.poses[i].image_id] = layout.pose_row[i];
  }
  for (size_t i = 0; i < bundle.cameras.size(); ++i) {
    if (layout.camera_row[i] < 0) continue;
    rows_of_camera_[bundle.cameras[i].camera_id] = {layout.camera_row[i],
                                                    bundle.cameras[i].refined};
  }
}

std::vector<int> BundleFactor::RowsOf(const Bundle& bundle, const BundleLayout& layout) const {
  std::vector<int> rows(layout.size, -1);
  for (size_t i = 0; i < bundle.poses.size(); ++i) {
    const auto known = row_of_image_.find(bundle.poses[i].image_id);
    if (layout.pose_row[i] < 0 || known == row_of_image_.end()) continue;
    for (int k = 0; k < 6; ++k) rows[layout.pose_row[i] + k] = known->second + k;
  }
  for (size_t i = 0; i < bundle.cameras.size(); ++i) {
    const auto known = rows_of_camera_.find(bundle.cameras[i].camera_id);
    if (layout.camera_row[i] < 0 || known == rows_of_camera_.end()) continue;
    if (known->second.refined != bundle.cameras[i].refined) continue;
    for (size_t k = 0; k < bundle.cameras[i].refined.size(); ++k) {
      rows[layout.camera_row[i] + k] = known->second.row + static_cast<int>(k);
    }
  }
  return rows;
}

}  // namespace skein
