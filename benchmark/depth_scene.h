// The photos and the sparse points of a COLMAP model, as libs/depth takes them. The only file of
// the depth benchmark that knows COLMAP's types.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "depth/neighbours.h"
#include "depth/photo_table.h"

namespace skein {

struct DepthScene {
  std::vector<std::string> names;  // of the photos, ascending
  std::vector<LensCamera> lenses;  // of each photo
  std::vector<int> cameras;        // of each photo: photos with equal numbers have one lens
  std::vector<SparsePhoto> photos;
  std::vector<Eigen::Vector3d> points;  // in the model's frame
};

// Throws std::runtime_error when there is no model.
DepthScene ReadDepthScene(const std::string& model);

// The photo in shades of grey, as it is stored. Throws std::runtime_error.
cv::Mat1b ReadGreyPhoto(const std::string& folder, const std::string& name);

}  // namespace skein
