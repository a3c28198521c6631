#include "matching/descriptor_cells.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace skein {
namespace {

// Of 64 cells 8 hold 99.5 % of the matches of all features with all, in a fifth of the comparisons,
// and 4 hold 98 % of those of pairs that overlap much, in a tenth (docs/experiments/cascade.md).
constexpr size_t kCloseCells = 4, kNearCells = 8;

// Cells of each feature, `per_feature` of them, to lists.
CellLists ListsOf(const std::vector<uint32_t>& cells, size_t per_feature, size_t num_cells) {
  CellLists lists;
  lists.begin.assign(num_cells + 1, 0);
  for (const uint32_t cell : cells) ++lists.begin[cell + 1];
  std::partial_sum(lists.begin.begin(), lists.begin.end(), lists.begin.begin());
  lists.members.resize(cells.size());
  std::vector<uint32_t> next(lists.begin.begin(), lists.begin.end() - 1);
  for (size_t i = 0; i < cells.size(); ++i) {
    lists.members[next[cells[i]]++] = static_cast<uint32_t>(i / per_feature);
  }
  return lists;
}

size_t BytesOf(const CellLists& lists) {
  return (lists.begin.size() + lists.members.size()) * sizeof(uint32_t);
}

}  // namespace

size_t FeatureCells::MemoryBytes() const { return BytesOf(home) + BytesOf(close) + BytesOf(near); }

// A centre lies in the space of the principal axes. What a descriptor has beside them adds the same
// to its distances from all centres, so these may be compared in all 128 dimensions.
DescriptorCells::DescriptorCells(const Codebook& codebook, KernelVersion kernel) : kernel_(kernel) {
  const Codebook::Matrix centres =
      (codebook.centres * codebook.projection).rowwise() + codebook.mean.transpose();
  for (Eigen::Index k = 0; k < centres.rows(); ++k) {
    for (Eigen::Index d = 0; d < kDescriptorDim; ++d) {
      const double value = std::round(kDescriptorNorm * centres(k, d));
      centres_.push_back(static_cast<uint8_t>(std::clamp(value, 0.0, 255.0)));
    }
  }
  centres_ = CompactDescriptors(std::move(centres_));
  for (size_t i = 0; i < centres_.size(); i += kDescriptorDim) {
    norm_sq_.push_back(NormSq(centres_.data() + i));
  }
}

FeatureCells DescriptorCells::Assign(const std::vector<uint8_t>& descriptors) const {
  const size_t num_cells = norm_sq_.size();
  const size_t num_close = std::min(kCloseCells, num_cells);
  const size_t num_near = std::min(kNearCells, num_cells);
  std::vector<uint32_t> all(num_cells), home, close, near;
  std::iota(all.begin(), all.end(), 0);
  std::vector<int32_t> dots;
  std::vector<std::pair<int32_t, uint32_t>> ranked(num_cells);  // distance^2 - |descriptor|^2
  for (size_t i = 0; i < descriptors.size(); i += kDescriptorDim) {
    DotProducts(kernel_, descriptors.data() + i, centres_.data(), all, &dots);
    for (uint32_t k = 0; k < num_cells; ++k) ranked[k] = {norm_sq_[k] - 2 * dots[k], k};
    std::partial_sort(ranked.begin(), ranked.begin() + num_near, ranked.end());
    home.push_back(ranked[0].second);
    for (size_t n = 0; n < num_close; ++n) close.push_back(ranked[n].second);
    for (size_t n = 0; n < num_near; ++n) near.push_back(ranked[n].second);
  }
  return {ListsOf(home, 1, num_cells), ListsOf(close, num_close, num_cells),
          ListsOf(near, num_near, num_cells)};
}

std::vector<ProductPart> PartsOf(const CellLists& home, const CellLists& others) {
  std::vector<ProductPart> parts;
  for (size_t k = 0; k + 1 < home.begin.size(); ++k) parts.push_back({home[k], others[k]});
  return parts;
}

}  // namespace skein
