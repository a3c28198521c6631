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

void GuidedMatcher::Arrange(const PhotoFeatures& second) {
  const std::vector<uint32_t>& features = fan_.features();
  descriptors_.resize(second.descriptors.size());
  norm_sq_.resize(features.size());
  place_of_.resize(features.size());
  for (uint32_t place = 0; place < features.size(); ++place) {
    const uint32_t j = features[place];
    std::copy_n(second.descriptors.begin() + size_t{kDescriptorDim} * j, kDescriptorDim,
                descriptors_.begin() + size_t{kDescriptorDim} * place);
    norm_sq_[place] = second.index.norm_sq[j];
    place_of_[j] = place;
  }
}

std::vector<IndexPair> GuidedMatcher::Match(const PhotoFeatures& first, const PhotoFeatures& second,
                                            const Eigen::Matrix3d& F) {
  const double norm = F.norm();
  if (!(norm > 0) || !std::isfinite(norm)) return {};
  fan_.Build(second.points, F);
  Arrange(second);
  rows_.assign(first.points.size(), {kNone, kNone, 0});
  columns_.assign(second.points.size(), {kNone, kNone, 0});
  const int64_t insignificant_sq = InsignificantSq(options_);
  for (uint32_t i = 0; i < first.points.size(); ++i) {
    neighbours_.clear();
    fan_.Find(first.points[i], options_.max_error_px, &neighbours_);
    DotProducts(options_.kernel, first.descriptors.data() + size_t{kDescriptorDim} * i,
                descriptors_.data(), neighbours_, &dots_);
    const int32_t norm_sq = first.index.norm_sq[i];
    for (size_t k = 0; k < neighbours_.size(); ++k) {
      const uint32_t place = neighbours_[k];
      const int32_t distance_sq = norm_sq + norm_sq_[place] - 2 * dots_[k];
      if (distance_sq >= insignificant_sq) continue;
      rows_[i].Insert(distance_sq, fan_.features()[place]);
      columns_[place].Insert(distance_sq, i);
    }
  }
  std::vector<IndexPair> matches;
  for (uint32_t i = 0; i < rows_.size(); ++i) {
    if (!Passes(rows_[i])) continue;
    const Nearest& column = columns_[place_of_[rows_[i].best]];
    if (column.best == i && Passes(column)) matches.push_back({i, rows_[i].best});
  }
  return matches;
}

}  // namespace skein
