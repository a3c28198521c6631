// Space that photos have looked through. Inside of libs/state/guidance.
#pragma once

#include <Eigen/Core>
#include <bitset>
#include <vector>

#include "guidance/cells.h"
#include "guidance/guided_map.h"

namespace skein {

// Space in voxels: one is free if a photo observes a point through it. Any other voxel may hold
// something.
class FreeSpace {
 public:
  // Walks the first `reach` (submap units) of each line of sight. Costs the number of observations
  // times reach / width.
  FreeSpace(const GuidedMap& map, double width, double reach);

  // Whether nine tenths of the way, as far as `reach` from the first, are free. The last voxel and
  // a half before `to` do not count: they hold what is looked at.
  bool IsClear(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;

 private:
  static constexpr int kBlockBits = 3;
  static constexpr int kBlock = 1 << kBlockBits;  // voxels of a block along an axis
  using Block = std::bitset<static_cast<size_t>(kBlock* kBlock* kBlock)>;

  // visit(block, voxel) for each voxel's width of the way, where find(cell) is the block or null.
  template <class Find, class Visit>
  void Walk(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Find& find,
            const Visit& visit) const;

  double width_, reach_;
  Cells cells_;  // of blocks
  std::vector<Block> blocks_;
};

}  // namespace skein
