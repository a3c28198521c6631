// When to start a submap, and from which pair of photos.
//
// A photo is an orphan when every live submap has processed its matches and none registered it. The
// pair of orphans with the largest inliers x angle becomes a seed, once. Two seeds must never grow
// into one scene side by side. So a photo waits in two cases:
//  - A live submap that could reach it over a chain of verified pairs has not worked up to it.
//  - A submap deferred it a short while ago: the submap may grow towards it.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "merger/submap_directory.h"

namespace skein {

struct SeedSituation {
  double quiet_s = 0.0;    // since the last photo was accepted or matched, 0 while one is in flight
  bool finishing = false;  // the session drained: nothing comes any more
  int64_t head_seq = 0;    // everything up to here is in the directory
};

struct SeedChoice {
  int64_t image_id1 = 0;
  int64_t image_id2 = 0;
  int num_inliers = 0;
  double tri_angle_rad = 0.0;
};

class SeedPolicy {
 public:
  // Ingest would not have this seed: never again.
  void OnRefused(int64_t image_id1, int64_t image_id2);

  // nullopt: nothing to seed now. Equal input gives equal output.
  std::optional<SeedChoice> Choose(const SubmapDirectory& directory,
                                   const SeedSituation& situation) const;

 private:
  std::optional<SeedChoice> BestPair(const std::vector<int64_t>& orphans, double min_angle_rad,
                                     int min_inliers, double max_forward_motion,
                                     const SubmapDirectory& directory) const;
  std::optional<SeedChoice> ChooseIn(const std::vector<int64_t>& orphans,
                                     const SubmapDirectory& directory,
                                     const SeedSituation& situation) const;

  std::set<std::pair<int64_t, int64_t>> refused_;  // images, smaller id first
};

}  // namespace skein
