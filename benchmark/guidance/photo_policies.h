// Policies that choose the next photo of a pool.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "benchmark/support/photo_pool.h"
#include "guidance/quality.h"
#include "guidance/stations.h"

namespace skein {

// Photos are indices into the pool.
struct Capture {
  std::vector<int> taken, registered, left;
  PoolMap map;         // of the registered ones
  PlaceQuality place;  // of that map
  int failed = 0;      // that did not register when they were taken
};

// One of `capture.left`.
using Policy = std::function<int(const PhotoPool& pool, const Capture& capture)>;

const std::vector<std::string>& PolicyNames();
// `name`: one of PolicyNames() other than "advice". `seed`: of what is random.
Policy PolicyNamed(const std::string& name, uint64_t seed);

// The left photo nearest to the viewpoint: position in units of the distance to what the viewpoint
// looks at, plus direction in radians.
int NearestLeft(const PhotoPool& pool, const Capture& capture, const Station& station);

// "advice": takes the photo of the best viewpoint. If guidance has no viewpoint to give, it takes
// the farthest overlapping photo of the pool.
class Follower {
 public:
  // Takes the photo of a viewpoint: index into the pool.
  using Photographer = std::function<int(const Capture&, const Station&, int agent)>;

  Follower(const PhotoPool& pool, const Photographer& photograph)
      : pool_(pool), photograph_(photograph) {}

  int Take(const Capture& capture);

  // How far from its viewpoint each photo was taken, as NearestLeft has it.
  const std::vector<double>& from_station() const { return from_station_; }
  // How often there was none.
  int without_station() const { return without_station_; }

 private:
  const PhotoPool& pool_;
  const Photographer photograph_;
  std::vector<std::pair<int, VainPhoto>> advised_;  // photos of the pool
  std::vector<double> from_station_;
  int without_station_ = 0;
};

}  // namespace skein
