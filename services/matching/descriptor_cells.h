#pragma once

// Cells of descriptor space, so that a descriptor is compared only with those that may be near it:
// the inverted file of Jegou et al. 2011, "Product quantization for nearest neighbor search",
// section IV, without its compression.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "matching/kernel.h"
#include "vocabulary/codebook.h"

namespace skein {

// Features by cell: those of cell k are members[begin[k]] up to members[begin[k + 1]], ascending.
struct CellLists {
  std::vector<uint32_t> begin;
  std::vector<uint32_t> members;

  IndexSpan operator[](size_t cell) const {
    return {members.data() + begin[cell], static_cast<int>(begin[cell + 1] - begin[cell])};
  }
};

// Features of one photo by cell; empty without cells.
struct FeatureCells {
  CellLists home;   // each feature in its nearest cell
  CellLists close;  // each feature in its 4 nearest cells
  CellLists near;   // each feature in its 8 nearest cells

  bool empty() const { return home.begin.empty(); }
  size_t MemoryBytes() const;
};

// The cells of a codebook. Immutable, so threads may share it.
class DescriptorCells {
 public:
  explicit DescriptorCells(const Codebook& codebook, KernelVersion kernel = FastestKernel());

  // descriptors: N x 128, row major, compact (kernel.h). Exact, so the same with each kernel.
  FeatureCells Assign(const std::vector<uint8_t>& descriptors) const;

 private:
  std::vector<uint8_t> centres_;  // K x 128, compact
  std::vector<int32_t> norm_sq_;  // of each
  KernelVersion kernel_;
};

// Parts of the product of two photos: each feature of the first, by its `home`, with the features
// of the second that have its cell in `others`, which are `close` or `near`. Both of the same
// cells.
std::vector<ProductPart> PartsOf(const CellLists& home, const CellLists& others);

}  // namespace skein
