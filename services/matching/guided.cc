#include "matching/guided.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace skein {
namespace {

constexpr int32_t kNone = std::numeric_limits<int32_t>::max();

// A neighbour this far can neither match nor spoil a match by the ratio test.
int64_t InsignificantSq(const GuidedOptions& options) {
  const double ratio_sq = options.max_ratio * options.max_ratio;
  if (ratio_sq == 0) return int64_t{options.max_distance_sq} + 1;
  return static_cast<int64_t>(options.max_distance_sq / ratio_sq) + 2;
}

}  // namespace

void GuidedMatcher::Nearest::Insert(int32_t distance_sq, uint32_t index) {
  second_sq = std::min(second_sq, std::max(best_sq, distance_sq));
  if (distance_sq < best_sq || (distance_sq == best_sq && index < best)) best = index;
  best_sq = std::min(best_sq, distance_sq);
}

bool GuidedMatcher::Passes(const Nearest& nearest) const {
  if (nearest.best_sq > options_.max_distance_sq) return false;
  const int64_t ratio_sq = std::llround(options_.max_ratio * options_.max_ratio * 1e6);
  if (ratio_sq == 0 || nearest.second_sq == kNone) return true;
  return nearest.best_sq * int64_t{1000000} < nearest.second_sq * ratio_sq;
}

std::vector<IndexPair> GuidedMatcher::Match(const PhotoFeatures& first, const PhotoFeatures& second,
                                            const Eigen::Matrix3d& F) {
  const double norm = F.norm();
  if (!(norm > 0) || !std::isfinite(norm)) return {};
  fan_.Build(second.points, F);
  rows_.assign(first.points.size(), {kNone, kNone, 0});
  columns_.assign(second.points.size(), {kNone, kNone, 0});
  const int64_t insignificant_sq = InsignificantSq(options_);
  for (uint32_t i = 0; i < first.points.size(); ++i) {
    neighbours_.clear();
    fan_.Find(first.points[i], options_.max_error_px, &neighbours_);
    DotProducts(options_.kernel, first.descriptors.data() + size_t{kDescriptorDim} * i,
                second.descriptors.data(), neighbours_, &dots_);
    const int32_t norm_sq = first.index.norm_sq[i];
    for (size_t k = 0; k < neighbours_.size(); ++k) {
      const uint32_t j = neighbours_[k];
      const int32_t distance_sq = norm_sq + second.index.norm_sq[j] - 2 * dots_[k];
      if (distance_sq >= insignificant_sq) continue;
      rows_[i].Insert(distance_sq, j);
      columns_[j].Insert(distance_sq, i);
    }
  }
  std::vector<IndexPair> matches;
  for (uint32_t i = 0; i < rows_.size(); ++i) {
    if (!Passes(rows_[i])) continue;
    const Nearest& column = columns_[rows_[i].best];
    if (column.best == i && Passes(column)) matches.push_back({i, rows_[i].best});
  }
  return matches;
}

}  // namespace skein
