#pragma once

// Data of a photo's features for the cascade (pair_matcher.h), made once for all its pairs.

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "matching/descriptor_cells.h"

namespace skein {

constexpr int kMaxCoarse = 1024;

struct FeatureIndex {
  std::vector<uint32_t> coarsest;           // at most kMaxCoarse features, by falling scale
  std::vector<uint8_t> coarse_descriptors;  // of these, coarsest.size() x 128
  std::vector<int32_t> norm_sq;             // of each descriptor
  FeatureCells cells;

  size_t MemoryBytes() const;
};

// descriptors: points.size() x 128, compact; scales_px: one a point. If scales are equal, the first
// counts as the coarser. Without `cells` the index has none.
FeatureIndex MakeFeatureIndex(const std::vector<Eigen::Vector2d>& points,
                              const std::vector<float>& scales_px,
                              const std::vector<uint8_t>& descriptors,
                              const DescriptorCells* cells = nullptr);

}  // namespace skein
