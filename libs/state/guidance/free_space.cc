#include "guidance/free_space.h"

#include <algorithm>
#include <cmath>

namespace skein {

template <class Find, class Visit>
void FreeSpace::Walk(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Find& find,
                     const Visit& visit) const {
  constexpr int kMaxVoxel = 1 << 22;  // a place further away has no cell
  const Eigen::Vector3d way = to - from;
  const double length = way.norm(), end = std::min(length - 1.5 * width_, reach_);
  if (!(end > 0)) return;
  const Eigen::Vector3d begin = from / width_, step = way / length;  // in voxels
  const int num = static_cast<int>(end / width_);
  Cells::Cell last{};
  decltype(find(last)) block = nullptr;
  for (int i = 0; i <= num; ++i) {
    const Eigen::Array3d at = (begin + i * step).array().floor();
    if (!(at.abs() < kMaxVoxel).all()) return;
    const Eigen::Array3i voxel = at.cast<int>();
    const Cells::Cell cell{voxel.x() >> kBlockBits, voxel.y() >> kBlockBits,
                           voxel.z() >> kBlockBits};
    if (i == 0 || cell != last) block = find(cell);
    last = cell;
    const auto within = [](int v) { return static_cast<size_t>(v & (kBlock - 1)); };
    visit(block, (within(voxel.x()) * kBlock + within(voxel.y())) * kBlock + within(voxel.z()));
  }
}

FreeSpace::FreeSpace(const GuidedMap& map, double width, double reach)
    : width_(width), reach_(reach), cells_(kBlock * width) {
  std::vector<Eigen::Vector3d> centres;
  for (const GuidedPhoto& photo : map.photos) centres.push_back(photo.cam_from_world.Centre());
  const auto find = [&](const Cells::Cell& cell) {
    const uint32_t index = cells_.Occupy(cell);
    if (index == blocks_.size()) blocks_.emplace_back();
    return &blocks_[index];
  };
  for (const GuidedPoint& point : map.points) {
    for (const uint32_t photo : point.photos) {
      Walk(centres[photo], point.xyz, find, [](Block* block, size_t voxel) { block->set(voxel); });
    }
  }
}

bool FreeSpace::IsClear(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
  constexpr double kMaxUnknown = 0.1;
  int num = 0, unknown = 0;
  const auto find = [&](const Cells::Cell& cell) -> const Block* {
    const uint32_t* index = cells_.Find(cell);
    return index == nullptr ? nullptr : &blocks_[*index];
  };
  Walk(from, to, find, [&](const Block* block, size_t voxel) {
    ++num;
    unknown += block == nullptr || !block->test(voxel);
  });
  return unknown <= kMaxUnknown * num;
}

}  // namespace skein
