#include "surface/map_band.h"

#include <algorithm>
#include <cmath>

#include "core/threads.h"
#include "depth/dense_points.h"

namespace skein {
namespace {

constexpr double kErrorsOfReach = 3;
constexpr double kLeastCosine = 0.035;  // 88 degrees
constexpr double kBestError = 0.5;      // voxels: a smaller one is that of the grid
// A pixel that covers more than kPartOfPixel sides of a voxel marks blocks in several places.
constexpr double kPartOfPixel = 4;
constexpr int kMostParts = 8;              // in x and in y
constexpr double kStep = 2;                // voxels, along a ray
constexpr double kMostIndex = 1 << 27;     // of a block: those of its voxels fit into 32 bits
constexpr double kLeastPixelWeight = 0.5;  // a lower one is rounded to 0

}  // namespace

MapBand::MapBand(const DepthMap& map, double voxel, int num_threads)
    : map_(map),
      voxel_(voxel),
      num_threads_(num_threads),
      width_(map.depth.cols),
      height_(map.depth.rows),
      calibration_(map.camera.CalibrationOfIndices().cast<float>()),
      pixels_(map.depth.total()) {
  ForEachOnThreads(num_threads_, height_, [this](size_t y) {
    for (int x = 0; x < width_; ++x) pixels_[x + y * width_] = PixelOf(x, static_cast<int>(y));
  });
}

MapBand::Pixel MapBand::PixelOf(int x, int y) const {
  const double depth = map_.depth(y, x), error = map_.error(y, x);
  if (!(depth > 0) || depth > kMostParts * kPartOfPixel * voxel_ * map_.camera.focal_px.x()) {
    return {};
  }
  const auto normal = NormalAt(map_, x, y);
  if (!normal) return {};
  const Eigen::Vector3d ray = map_.camera.Ray({x + 0.5, y + 0.5}).homogeneous();
  const double slope = -normal->dot(ray), cosine = slope / ray.norm();
  if (!(cosine > kLeastCosine)) return {};
  const double accuracy = std::min(1.0, kBestError * voxel_ / error);
  const double weight = kMostWeight * cosine * accuracy * accuracy;
  if (weight < kLeastPixelWeight) return {};
  const double reach = std::clamp<double>(kErrorsOfReach * error / voxel_, kLeastReach, kMostReach);
  return {static_cast<float>(slope), static_cast<float>(reach * voxel_),
          static_cast<float>(weight)};
}

std::vector<BlockIndex> MapBand::Blocks() const {
  std::vector<BlockSet> sets(num_threads_);
  RunOnThreads(num_threads_, [&](int thread) {
    for (int y = thread; y < height_; y += num_threads_) {
      for (int x = 0; x < width_; ++x) AddBlocks(x, y, &sets[thread]);
    }
  });
  for (int i = 1; i < num_threads_; ++i) sets[0].insert(sets[i].begin(), sets[i].end());
  std::vector<BlockIndex> blocks(sets[0].begin(), sets[0].end());
  std::sort(blocks.begin(), blocks.end());
  return blocks;
}

void MapBand::AddBlocks(int x, int y, BlockSet* blocks) const {
  const Pixel& pixel = At(x, y);
  if (!(pixel.weight > 0)) return;
  const double depth = map_.depth(y, x), half = pixel.reach / pixel.slope;  // in depth
  const int parts = std::max(
      1, static_cast<int>(std::ceil(depth / map_.camera.focal_px.x() / (kPartOfPixel * voxel_))));
  std::optional<BlockIndex> last;
  for (int part = 0; part < parts * parts; ++part) {
    const Eigen::Vector3d ray =
        map_.camera.Ray({x + (part % parts + 0.5) / parts, y + (part / parts + 0.5) / parts})
            .homogeneous();
    const int steps = static_cast<int>(std::ceil(2 * half * ray.norm() / (kStep * voxel_)));
    for (int i = 0; i <= steps; ++i) {
      const double z = depth - half + 2 * half * i / steps;
      const Eigen::Vector3d at = map_.cam_from_world.ToWorld(z * ray) / (kBlockSide * voxel_);
      if (!(z > 0 && at.cwiseAbs().maxCoeff() < kMostIndex)) continue;
      const Eigen::Vector3i index = at.array().floor().cast<int>();
      const BlockIndex block{index.x(), index.y(), index.z()};
      if (last && block == *last) continue;
      blocks->insert(block);
      last = block;
    }
  }
}

std::optional<BandSample> MapBand::At(const Eigen::Vector3f& in_camera) const {
  const float z = in_camera.z();
  if (!(z > 0)) return std::nullopt;
  const float u = calibration_(0, 0) * in_camera.x() / z + calibration_(0, 2);
  const float v = calibration_(1, 1) * in_camera.y() / z + calibration_(1, 2);
  if (!(u > -0.5f && v > -0.5f && u + 0.5f < width_ && v + 0.5f < height_)) return std::nullopt;
  const int x = static_cast<int>(u + 0.5f), y = static_cast<int>(v + 0.5f);
  const Pixel& pixel = At(x, y);
  if (!(pixel.weight > 0)) return std::nullopt;
  const float depth = Interpolate(u, v, map_.depth(y, x), pixel.reach / pixel.slope);
  const float distance = (depth - z) * pixel.slope;
  if (!(std::abs(distance) <= pixel.reach)) return std::nullopt;
  const float part = std::min(1.0f, 2 + 2 * distance / pixel.reach);
  const int weight = static_cast<int>(pixel.weight * part + 0.5f);
  if (weight == 0) return std::nullopt;
  const float steps = distance / static_cast<float>(voxel_) * kDistanceSteps;
  return BandSample{x, y, weight, static_cast<int>(std::lround(steps))};
}

float MapBand::Interpolate(float u, float v, float depth, float tolerance) const {
  const float left = std::floor(u), top = std::floor(v);
  const int x = static_cast<int>(left), y = static_cast<int>(top);
  if (x < 0 || y < 0 || x + 1 >= width_ || y + 1 >= height_) return depth;
  const float* above = &map_.depth(y, x);
  const float* below = &map_.depth(y + 1, x);
  for (const float other : {above[0], above[1], below[0], below[1]}) {
    // Holes, too, are no part of the surface.
    if (!(other > 0 && std::abs(other - depth) <= tolerance)) return depth;
  }
  const float a = u - left, b = v - top;
  return (1 - b) * ((1 - a) * above[0] + a * above[1]) + b * ((1 - a) * below[0] + a * below[1]);
}

}  // namespace skein
