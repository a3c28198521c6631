#pragma once

#include <cstdint>
#include <functional>
#include <unordered_map>
#include <utility>
#include <vector>

namespace skein {

// The similarity of two photos from the distance of their unit global descriptors (0..2):
// s = (1 + cosine) / 2 = 1 - d^2 / 4, kept within [0.05, 1].
double SimilarityFromDistance(double distance);

struct Similar {
  uint32_t image_id;
  double similarity;
};

// For each photo the others most like it, best first. Symmetric: a photo that comes later enters
// the lists of those it resembles.
class SimilarityLists {
 public:
  // `max_length`: kept of a photo; more than the tree's top N as not all are registered.
  explicit SimilarityLists(size_t max_length = 64) : max_length_(max_length) {}
  void Add(uint32_t image_id, const std::vector<std::pair<uint32_t, double>>& others_distances);
  const std::vector<Similar>& Of(uint32_t image_id) const;

 private:
  void Insert(uint32_t image_id, Similar similar);

  size_t max_length_;
  std::unordered_map<uint32_t, std::vector<Similar>> lists_;
};

// Hierarchical association tree (paper section 3.3.1): ripple 1 holds the new photo's top 8, ripple
// 2 their top 8, ... to ripple 4 (L_h). Each photo stands in the first ripple that reaches it.

struct TreeNode {
  uint32_t image_id = 0;
  int ripple = 0;     // 0: the new photo
  double path = 0;    // sum of 1/s along the shortest path from the new photo
  double weight = 1;  // p of Eq. 2; 0 in the last ripple, which is held constant (p = infinity)
};

// Only photos for which `is_member` is true count. Sorted by ripple, then path, then id.
std::vector<TreeNode> BuildAssociationTree(const SimilarityLists& lists, uint32_t new_image_id,
                                           const std::function<bool(uint32_t)>& is_member);

}  // namespace skein
