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

// Keeps the depth maps that it has made: a photo that got no new neighbour needs no new one.
class DenseCloud {
 public:
  DenseCloud(const PhotoPool& pool, int threads) : pool_(pool), threads_(threads) {}

  // World points.
  std::vector<Eigen::Vector3d> Make(const PoolMap& map);

 private:
  using Key = std::tuple<int, std::vector<int>, int, int>;  // pool's photos, steps of depth

  std::vector<SweepPhoto> PhotosOf(const PoolMap& map, std::vector<Key>* keys) const;

  const PhotoPool& pool_;
  const int threads_;
  std::map<Key, cv::Mat1f> depths_;
};

}  // namespace skein
