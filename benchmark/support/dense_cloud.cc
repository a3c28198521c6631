#include "benchmark/support/dense_cloud.h"

#include <algorithm>
#include <cmath>

#include "clients/places/parallel.h"
#include "core/statistics.h"

namespace skein {
namespace {

constexpr double kMinDegrees = 5, kMaxDegrees = 30;
constexpr size_t kNumNeighbours = 4;     // of a photo: those with most common points
constexpr int kMinNeighbourPoints = 15;  // common ones
constexpr double kDepthStep = 1.25;      // ends of the search are powers of it

// common[i][j]: points of both photos, seen 5 to 30 degrees apart.
std::vector<std::vector<int>> CountCommon(const GuidedMap& map) {
  const double min_cos = std::cos(kMaxDegrees * kRadian);
  const double max_cos = std::cos(kMinDegrees * kRadian);
  std::vector<Eigen::Vector3d> centres;
  for (const GuidedPhoto& photo : map.photos) centres.push_back(photo.cam_from_world.Centre());
  std::vector<std::vector<int>> common(map.photos.size(), std::vector<int>(map.photos.size(), 0));
  for (const GuidedPoint& point : map.points) {
    for (const uint32_t a : point.photos) {
      for (const uint32_t b : point.photos) {
        const double cosine =
            (centres[a] - point.xyz).normalized().dot((centres[b] - point.xyz).normalized());
        common[a][b] += cosine > min_cos && cosine < max_cos;
      }
    }
  }
  return common;
}

std::vector<int> BestNeighbours(const std::vector<int>& common) {
  std::vector<int> neighbours;
  for (int i = 0; i < static_cast<int>(common.size()); ++i) {
    if (common[i] >= kMinNeighbourPoints) neighbours.push_back(i);
  }
  std::stable_sort(neighbours.begin(), neighbours.end(),
                   [&](int a, int b) { return common[a] > common[b]; });
  if (neighbours.size() > kNumNeighbours) neighbours.resize(kNumNeighbours);
  std::sort(neighbours.begin(), neighbours.end());
  return neighbours;
}

std::vector<std::vector<double>> DepthsOfPhotos(const GuidedMap& map) {
  std::vector<std::vector<double>> depths(map.photos.size());
  for (const GuidedPoint& point : map.points) {
    for (const uint32_t i : point.photos) {
      depths[i].push_back(map.photos[i].cam_from_world.Apply(point.xyz).z());
    }
  }
  return depths;
}

// Neighbours of a photo and those that it is a neighbour of.
std::vector<int> LinkedPhotos(const std::vector<SweepPhoto>& photos, int reference) {
  std::vector<int> linked = photos[reference].neighbours;
  for (int i = 0; i < static_cast<int>(photos.size()); ++i) {
    const auto& of_other = photos[i].neighbours;
    if (std::count(of_other.begin(), of_other.end(), reference) > 0 &&
        std::count(linked.begin(), linked.end(), i) == 0) {
      linked.push_back(i);
    }
  }
  return linked;
}

}  // namespace

std::vector<SweepPhoto> DenseCloud::PhotosOf(const PoolMap& map, std::vector<Key>* keys) const {
  const std::vector<std::vector<int>> common = CountCommon(map.map);
  const std::vector<std::vector<double>> depths = DepthsOfPhotos(map.map);
  std::vector<SweepPhoto> photos;
  for (size_t i = 0; i < map.taken.size(); ++i) {
    SweepPhoto photo;
    photo.grey = pool_.grey(map.taken[i]);
    const GuidedCamera& camera = pool_.camera(map.taken[i]);
    photo.focal_px = camera.FocalPx();
    photo.principal_point = {camera.cx_px, camera.cy_px};
    photo.cam_from_world = map.map.photos[i].cam_from_world;
    int near_step = 0, far_step = 1;
    if (!depths[i].empty()) {
      const double near = std::max(1e-3, 0.8 * percentile(depths[i], 1));
      const double far = std::max(near, 1.25 * percentile(depths[i], 99));
      near_step = static_cast<int>(std::floor(std::log(near) / std::log(kDepthStep)));
      far_step = static_cast<int>(std::ceil(std::log(far) / std::log(kDepthStep))) + 1;
      photo.neighbours = BestNeighbours(common[i]);
    }
    photo.near = std::pow(kDepthStep, near_step);
    photo.far = std::pow(kDepthStep, far_step);
    std::vector<int> in_pool;
    for (const int k : photo.neighbours) in_pool.push_back(map.taken[k]);
    std::sort(in_pool.begin(), in_pool.end());
    keys->emplace_back(map.taken[i], in_pool, near_step, far_step);
    photos.push_back(std::move(photo));
  }
  return photos;
}

std::vector<Eigen::Vector3d> DenseCloud::Make(const PoolMap& map) {
  std::vector<Key> keys;
  const std::vector<SweepPhoto> photos = PhotosOf(map, &keys);
  std::vector<cv::Mat1f> depths(photos.size());
  sim::ParallelFor(static_cast<int>(photos.size()), threads_, [&](int i) {
    const auto known = depths_.find(keys[i]);
    depths[i] = known != depths_.end() ? known->second : SweepDepth(photos, i);
  });
  std::vector<std::vector<Eigen::Vector3d>> points(photos.size());
  sim::ParallelFor(static_cast<int>(photos.size()), threads_, [&](int i) {
    points[i] = ConsistentPoints(photos, depths, i, LinkedPhotos(photos, i));
  });
  std::vector<Eigen::Vector3d> all;
  for (size_t i = 0; i < photos.size(); ++i) {
    depths_[keys[i]] = depths[i];
    all.insert(all.end(), points[i].begin(), points[i].end());
  }
  return all;
}

}  // namespace skein
