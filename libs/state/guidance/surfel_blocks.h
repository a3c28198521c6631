// Surfels in blocks of space, so that a photo skips whole blocks far outside of its frame. Inside
// of libs/state/guidance.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

#include "guidance/cells.h"
#include "guidance/surface.h"

namespace skein {

class SurfelBlocks {
 public:
  struct Block {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    double radius = 0;  // of a ball around the positions
    std::vector<uint32_t> surfels;
    std::vector<Eigen::Vector3f> positions;  // of these
  };

  SurfelBlocks() : SurfelBlocks(1) {}
  explicit SurfelBlocks(double surfel_width) : cells_(kWidth * surfel_width), blocks_(1) {
    blocks_[0].radius = std::numeric_limits<double>::infinity();  // of what has no cell
  }

  void Add(uint32_t surfel, const Eigen::Vector3f& position) {
    const auto cell = cells_.CellOf(position.cast<double>());
    const size_t index = cell ? cells_.Occupy(*cell) + 1 : 0;
    if (index == blocks_.size()) {
      blocks_.emplace_back();
      blocks_.back().middle =
          cells_.width() * (Eigen::Array3d((*cell)[0], (*cell)[1], (*cell)[2]) + 0.5);
      blocks_.back().radius = 0.87 * cells_.width();
    }
    blocks_[index].surfels.push_back(surfel);
    blocks_[index].positions.push_back(position);
  }

  // As it was added.
  void Remove(uint32_t surfel, const Eigen::Vector3f& position) {
    const auto cell = cells_.CellOf(position.cast<double>());
    Block& block = blocks_[cell ? cells_.Occupy(*cell) + 1 : 0];
    for (size_t i = 0; i < block.surfels.size(); ++i) {
      if (block.surfels[i] != surfel) continue;
      block.surfels[i] = block.surfels.back();
      block.positions[i] = block.positions.back();
      block.surfels.pop_back();
      block.positions.pop_back();
      return;
    }
  }

  const std::vector<Block>& blocks() const { return blocks_; }

 private:
  static constexpr double kWidth = 6;  // of a block, in surfels

  Cells cells_;
  std::vector<Block> blocks_;
};

inline SurfelBlocks BlocksOf(const Surface& surface) {
  SurfelBlocks blocks(surface.cell);
  for (uint32_t i = 0; i < surface.surfels.size(); ++i) {
    if (!surface.surfels[i].IsGone()) blocks.Add(i, surface.surfels[i].position.cast<float>());
  }
  return blocks;
}

}  // namespace skein
