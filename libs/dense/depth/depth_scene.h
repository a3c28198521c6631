// The photos and the sparse points of a model, as depth maps are made from them.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "depth/neighbours.h"
#include "depth/photo_table.h"
#include "sfm/reconstruction.h"

namespace skein {

struct DepthScene {
  std::vector<std::string> names;  // of the registered photos, ascending
  std::vector<LensCamera> lenses;  // of each photo
  std::vector<int> cameras;        // of each photo: photos with equal numbers have one lens
  std::vector<SparsePhoto> photos;
  std::vector<Eigen::Vector3d> points;  // in the model's frame
};

DepthScene DepthSceneOf(const Reconstruction& model);

LensCamera LensOf(const Camera& camera);

}  // namespace skein
