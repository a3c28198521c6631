#include "matching/coarse_search.h"

#include <algorithm>
#include <cstddef>

#include "matching/two_view.h"

namespace skein {
namespace {

constexpr size_t kMaxBest = 10;

}  // namespace

std::vector<int64_t> CoarseSearch::Take(size_t count) {
  const size_t end = std::min(image_ids_.size(), num_taken_ + count);
  const auto begin = image_ids_.begin();
  const std::vector<int64_t> taken(begin + static_cast<std::ptrdiff_t>(num_taken_),
                                   begin + static_cast<std::ptrdiff_t>(end));
  num_taken_ = end;
  return taken;
}

void CoarseSearch::Tell(int64_t image_id, int num_matches) {
  if (num_matches >= kMinPairInliers) told_.emplace_back(num_matches, image_id);
}

std::vector<int64_t> CoarseSearch::Best() const {
  auto by_matches = told_;
  std::sort(by_matches.begin(), by_matches.end(), [](const auto& a, const auto& b) {
    return std::make_pair(-a.first, a.second) < std::make_pair(-b.first, b.second);
  });
  by_matches.resize(std::min(by_matches.size(), kMaxBest));
  std::vector<int64_t> ids;
  for (const auto& [num_matches, id] : by_matches) ids.push_back(id);
  return ids;
}

}  // namespace skein
