#pragma once

// Which photos are known to see the same scene: the verified pairs of the ledger's matches_t.

#include <cstdint>
#include <unordered_map>
#include <vector>

namespace skein {

class CovisibilityGraph {
 public:
  struct Edge {
    int64_t other_id = 0;
    int32_t num_inliers = 0;
    int64_t seq = 0;  // ledger position of the fact that tells of the pair
  };

  // A photo's matches come once; the caller sees to that.
  void Add(int64_t image_id, int64_t other_id, int32_t num_inliers, int64_t seq);

  // In the order of Add; empty for an unknown photo.
  const std::vector<Edge>& EdgesOf(int64_t image_id) const;

 private:
  std::unordered_map<int64_t, std::vector<Edge>> edges_;
};

}  // namespace skein
