#include "benchmark/support/photo_pool.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

namespace skein {

std::vector<SurfaceSample> ThinOut(const std::vector<SurfaceSample>& samples, double width) {
  std::vector<std::pair<std::array<int64_t, 3>, size_t>> cubes;
  for (size_t i = 0; i < samples.size(); ++i) {
    const Eigen::Array3d cube = (samples[i].xyz / width).array().floor();
    cubes.push_back({{static_cast<int64_t>(cube.x()), static_cast<int64_t>(cube.y()),
                      static_cast<int64_t>(cube.z())},
                     i});
  }
  std::sort(cubes.begin(), cubes.end());
  std::vector<SurfaceSample> thin;
  for (size_t i = 0; i < cubes.size(); ++i) {
    if (i == 0 || cubes[i].first != cubes[i - 1].first) thin.push_back(samples[cubes[i].second]);
  }
  return thin;
}

bool PhotoPool::Counts(const std::vector<int>& photos, const SurfaceSample& sample,
                       double max_gsd) const {
  int num_fine = 0;
  for (const int i : photos) {
    const double distance = (photo(i).cam_from_world.Centre() - sample.xyz).norm();
    if (distance > max_gsd * camera(i).FocalPx() || !Shows(i, sample)) continue;
    if (++num_fine == 2) return true;
  }
  return false;
}

std::vector<int> PhotoPool::PlacesIn(const std::vector<int>& taken) const {
  std::vector<int> places(photos_.size(), -1);
  for (size_t i = 0; i < taken.size(); ++i) places[taken[i]] = static_cast<int>(i);
  return places;
}

PoolMap PhotoPool::EmptyMapOf(const std::vector<int>& taken) const {
  PoolMap map;
  map.taken = taken;
  map.map.cameras = cameras_;
  for (const int i : taken) map.map.photos.push_back(photos_[i]);
  return map;
}

std::vector<int> PhotoPool::Registered(const std::vector<int>& taken) const {
  constexpr int kMinCommon = 30;
  std::vector<int> registered, waiting;
  const auto try_photo = [&](int photo) {
    const bool given = registered.size() < 2;
    if (given || CommonPoints(photo, registered) >= kMinCommon) registered.push_back(photo);
    return !registered.empty() && registered.back() == photo;
  };
  for (const int photo : taken) {
    if (!try_photo(photo)) {
      waiting.push_back(photo);
      continue;
    }
    for (bool more = true; more;) {
      const size_t before = waiting.size();
      waiting.erase(std::remove_if(waiting.begin(), waiting.end(), try_photo), waiting.end());
      more = waiting.size() < before;
    }
  }
  return registered;
}

}  // namespace skein
