// Dense points of some photos of a pool, by plane sweep.
#pragma once

#include <Eigen/Core>
#include <map>
#include <opencv2/core.hpp>
#include <tuple>
#include <vector>

#include "benchmark/support/photo_pool.h"
#include "benchmark/support/plane_sweep.h"

namespace skein {

struct DenseOptions {
  SweepOptions sweep;
  int num_neighbours = 4;  // of a photo: those with most common points seen 5 to 30 degrees apart
  int min_common = 15;     // such points of a neighbour
  int threads = 1;
};

// Keeps the depth maps that it has made: a photo that got no new neighbour needs no new one.
class DenseCloud {
 public:
  DenseCloud(const DenseOptions& options, const PhotoPool& pool) : options_(options), pool_(pool) {}

  // World points.
  std::vector<Eigen::Vector3d> Make(const PoolMap& map);

 private:
  using Key = std::tuple<int, std::vector<int>, int, int>;  // pool's photos, steps of depth

  std::vector<SweepPhoto> PhotosOf(const PoolMap& map, std::vector<Key>* keys) const;

  const DenseOptions options_;
  const PhotoPool& pool_;
  std::map<Key, cv::Mat1f> depths_;
};

}  // namespace skein
