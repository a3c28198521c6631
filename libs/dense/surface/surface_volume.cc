#include "surface/surface_volume.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace skein {
namespace {

// Adds `sign` times what a map tells about a block's voxels.
class BlockUpdate {
 public:
  BlockUpdate(const ColouredMap& map, const MapBand& band, double voxel, int sign)
      : map_(map), band_(band), voxel_(voxel), sign_(sign) {
    steps_ = (voxel * map.map->cam_from_world.rotation).cast<float>();
  }

  void Apply(const BlockIndex& index, Block* block) const {
    const DepthPose& pose = map_.map->cam_from_world;
    const Eigen::Vector3d corner = kBlockSide * voxel_ * Eigen::Vector3d(index.x, index.y, index.z);
    const Eigen::Vector3f first = pose.ToCamera(corner).cast<float>();
    for (int i = 0; i < kBlockVoxels; ++i) {
      const Eigen::Vector3f offset(static_cast<float>(i % kBlockSide),
                                   static_cast<float>(i / kBlockSide % kBlockSide),
                                   static_cast<float>(i / kBlockSide / kBlockSide));
      const auto sample = band_.At(first + steps_ * offset);
      if (sample) AddTo(*sample, &(*block)[i]);
    }
  }

 private:
  void AddTo(const BandSample& sample, Voxel* voxel) const {
    const int weight = sign_ * sample.weight;
    const cv::Vec3b& colour = (*map_.colours)(sample.y, sample.x);
    voxel->weight += weight;
    voxel->distance += weight * sample.distance;
    for (int c = 0; c < 3; ++c) voxel->colour[c] += weight * colour[c];
  }

  const ColouredMap& map_;
  const MapBand& band_;
  const double voxel_;
  const int sign_;
  Eigen::Matrix3f steps_;
};

SurfaceOptions Checked(const SurfaceOptions& options) {
  if (!(options.voxel > 0) || !std::isfinite(options.voxel) || options.num_threads < 1) {
    throw std::invalid_argument("a volume has voxels of a positive size, and a thread");
  }
  return options;
}

}  // namespace

SurfaceVolume::SurfaceVolume(const SurfaceOptions& options) : options_(Checked(options)) {}

Status SurfaceVolume::Add(const ColouredMap& map) {
  const MapBand band(*map.map, options_.voxel, options_.num_threads);
  const std::vector<BlockIndex> indices = band.Blocks();
  const int64_t num_new = std::count_if(indices.begin(), indices.end(),
                                        [&](const BlockIndex& i) { return Find(i) == nullptr; });
  if ((num_blocks_ + num_new) * static_cast<int64_t>(sizeof(Block)) > options_.max_bytes) {
    return ResourceExhausted("a volume of voxels of " + std::to_string(options_.voxel) +
                             " takes more than " + std::to_string(options_.max_bytes) + " bytes");
  }
  num_blocks_ += num_new;
  for (const BlockIndex& index : indices) {
    std::unique_ptr<Block>& block = entries_[index].block;
    if (block == nullptr) block = std::make_unique<Block>();
  }
  Apply(map, band, indices, 1);
  return Status::Ok();
}

void SurfaceVolume::Remove(const ColouredMap& map) {
  const MapBand band(*map.map, options_.voxel, options_.num_threads);
  Apply(map, band, band.Blocks(), -1);
}

// Blocks of the band that the map tells nothing about may be missing.
void SurfaceVolume::Apply(const ColouredMap& map, const MapBand& band,
                          const std::vector<BlockIndex>& indices, int sign) {
  std::vector<std::pair<BlockIndex, Entry*>> touched;
  for (const BlockIndex& index : indices) {
    const auto found = entries_.find(index);
    if (found != entries_.end() && found->second.block != nullptr) {
      touched.emplace_back(index, &found->second);
    }
  }
  const BlockUpdate update(map, band, options_.voxel, sign);
  ForEachOnThreads(options_.num_threads, touched.size(), [&](size_t i) {
    update.Apply(touched[i].first, touched[i].second->block.get());
  });
  ++version_;
  for (const auto& [index, entry] : touched) {
    const bool is_empty = DropIfEmpty(entry);
    if (!is_empty || sign < 0) entry->changed = version_;
  }
}

bool SurfaceVolume::DropIfEmpty(Entry* entry) {
  const bool is_empty = std::all_of(entry->block->begin(), entry->block->end(),
                                    [](const Voxel& voxel) { return voxel.weight == 0; });
  if (!is_empty) return false;
  entry->block.reset();
  --num_blocks_;
  return true;
}

std::vector<BlockIndex> SurfaceVolume::ChangedSince(uint64_t version) const {
  std::vector<BlockIndex> changed;
  for (const auto& [index, entry] : entries_) {
    if (entry.changed > version) changed.push_back(index);
  }
  std::sort(changed.begin(), changed.end());
  return changed;
}

std::vector<BlockIndex> SurfaceVolume::Blocks() const {
  std::vector<BlockIndex> blocks;
  for (const auto& [index, entry] : entries_) {
    if (entry.block != nullptr) blocks.push_back(index);
  }
  std::sort(blocks.begin(), blocks.end());
  return blocks;
}

const Block* SurfaceVolume::Find(const BlockIndex& index) const {
  const auto found = entries_.find(index);
  return found == entries_.end() ? nullptr : found->second.block.get();
}

}  // namespace skein
