#include "mapping/experiments/association_tree.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace skein {
namespace {

constexpr double kMinSimilarity = 0.05;
// The tree of the paper's experiments: top N of a photo, and depth L_h.
constexpr int kTopN = 8;
constexpr int kDepth = 4;

bool IsBefore(const Similar& a, const Similar& b) {
  return a.similarity != b.similarity ? a.similarity > b.similarity : a.image_id < b.image_id;
}

// The photos that a ripple reaches first, with their shortest paths.
std::map<uint32_t, double> NextRipple(const SimilarityLists& lists,
                                      const std::map<uint32_t, double>& ripple,
                                      const std::unordered_map<uint32_t, bool>& reached,
                                      const std::function<bool(uint32_t)>& is_member) {
  std::map<uint32_t, double> next;
  for (const auto& [id, path] : ripple) {
    int num_taken = 0;
    for (const Similar& similar : lists.Of(id)) {
      if (num_taken == kTopN) break;
      if (!is_member(similar.image_id)) continue;
      ++num_taken;
      if (reached.count(similar.image_id) > 0) continue;
      const double longer = path + 1.0 / similar.similarity;
      const auto [it, is_new] = next.emplace(similar.image_id, longer);
      if (!is_new) it->second = std::min(it->second, longer);
    }
  }
  return next;
}

}  // namespace

double SimilarityFromDistance(double distance) {
  return std::clamp(1.0 - distance * distance / 4.0, kMinSimilarity, 1.0);
}

void SimilarityLists::Add(uint32_t image_id,
                          const std::vector<std::pair<uint32_t, double>>& others_distances) {
  for (const auto& [other, distance] : others_distances) {
    if (other == image_id) continue;
    const double similarity = SimilarityFromDistance(distance);
    Insert(image_id, {other, similarity});
    Insert(other, {image_id, similarity});
  }
}

void SimilarityLists::Insert(uint32_t image_id, Similar similar) {
  std::vector<Similar>& list = lists_[image_id];
  for (const Similar& known : list) {
    if (known.image_id == similar.image_id) return;
  }
  list.insert(std::upper_bound(list.begin(), list.end(), similar, IsBefore), similar);
  if (list.size() > max_length_) list.pop_back();
}

const std::vector<Similar>& SimilarityLists::Of(uint32_t image_id) const {
  static const std::vector<Similar> kNone;
  const auto it = lists_.find(image_id);
  return it == lists_.end() ? kNone : it->second;
}

std::vector<TreeNode> BuildAssociationTree(const SimilarityLists& lists, uint32_t new_image_id,
                                           const std::function<bool(uint32_t)>& is_member) {
  std::vector<TreeNode> tree = {{new_image_id, 0, 0.0, 1.0}};
  std::unordered_map<uint32_t, bool> reached = {{new_image_id, true}};
  std::map<uint32_t, double> ripple = {{new_image_id, 0.0}};
  for (int i = 1; i <= kDepth && !ripple.empty(); ++i) {
    ripple = NextRipple(lists, ripple, reached, is_member);
    for (const auto& [id, path] : ripple) {
      reached[id] = true;
      const double weight = i < kDepth ? std::pow(path, -(i - 1.0)) : 0.0;
      tree.push_back({id, i, path, weight});
    }
  }
  std::sort(tree.begin(), tree.end(), [](const TreeNode& a, const TreeNode& b) {
    return std::tie(a.ripple, a.path, a.image_id) < std::tie(b.ripple, b.path, b.image_id);
  });
  return tree;
}

}  // namespace skein
