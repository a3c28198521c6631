#include "matching/feature_index.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "matching/kernel.h"

namespace skein {
namespace {

template <typename T>
size_t SizeOf(const std::vector<T>& values) {
  return values.size() * sizeof(T);
}

}  // namespace

size_t FeatureIndex::MemoryBytes() const {
  return SizeOf(coarsest) + SizeOf(coarse_descriptors) + SizeOf(norm_sq) + cells.MemoryBytes();
}

FeatureIndex MakeFeatureIndex(const std::vector<Eigen::Vector2d>& points,
                              const std::vector<float>& scales_px,
                              const std::vector<uint8_t>& descriptors,
                              const DescriptorCells* cells) {
  if (scales_px.size() != points.size() || descriptors.size() != points.size() * kDescriptorDim) {
    throw std::invalid_argument("points, scales and descriptors differ in number");
  }
  const auto is_coarser = [&scales_px](uint32_t a, uint32_t b) {
    const float scale_a = std::isnan(scales_px[a]) ? 0 : scales_px[a];
    const float scale_b = std::isnan(scales_px[b]) ? 0 : scales_px[b];
    return scale_a != scale_b ? scale_a > scale_b : a < b;
  };
  FeatureIndex index;
  index.coarsest.resize(points.size());
  std::iota(index.coarsest.begin(), index.coarsest.end(), 0);
  const size_t count = std::min<size_t>(kMaxCoarse, points.size());
  std::partial_sort(index.coarsest.begin(), index.coarsest.begin() + count, index.coarsest.end(),
                    is_coarser);
  index.coarsest.resize(count);
  index.coarsest.shrink_to_fit();
  index.coarse_descriptors.reserve(count * kDescriptorDim);
  for (const uint32_t i : index.coarsest) {
    const auto row = descriptors.begin() + static_cast<size_t>(i) * kDescriptorDim;
    index.coarse_descriptors.insert(index.coarse_descriptors.end(), row, row + kDescriptorDim);
  }
  index.norm_sq.reserve(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    index.norm_sq.push_back(NormSq(descriptors.data() + i * kDescriptorDim));
  }
  if (cells != nullptr) index.cells = cells->Assign(descriptors);
  return index;
}

}  // namespace skein
