#include "features/scale_space.h"

#include <algorithm>
#include <tuple>

#include "features/octave_tile.h"
#include "features/parallel_for.h"

namespace skein {
namespace {

constexpr int kMinOctaveSide = 16;  // pixels
// A tile's rows of all levels fit into the second-level cache.
constexpr int kTileWidth = 1088;
constexpr int kMinTileHeight = 256;  // of several; narrower ones blur too much of their neighbours

std::vector<cv::Rect> Tiles(int width, int height, int bands) {
  const int columns = (width + kTileWidth - 1) / kTileWidth;
  bands = std::clamp(bands, 1, std::max(1, height / kMinTileHeight));
  const auto start = [](int size, int count, int i) {  // even
    return i == count ? size : static_cast<int>(int64_t{size} * i / count) / 2 * 2;
  };
  std::vector<cv::Rect> tiles;
  for (int j = 0; j < bands; ++j) {
    for (int i = 0; i < columns; ++i) {
      const cv::Point from(start(width, columns, i), start(height, bands, j));
      tiles.emplace_back(from,
                         cv::Point(start(width, columns, i + 1), start(height, bands, j + 1)));
    }
  }
  return tiles;
}

auto Key(const Extremum& e) { return std::tie(e.octave, e.level, e.y, e.x, e.sigma); }

}  // namespace

void FloatRows::Resize(int width, int rows) {
  stride_ = static_cast<size_t>(width + 2 * kRowPadding + 15) / 16 * 16;
  // Vectors of the last row reach beyond it.
  const size_t size = stride_ * rows + 2 * kRowPadding;
  if (data_.total() < size) data_ = cv::Mat::zeros(1, static_cast<int>(size), CV_32F);
}

ScaleSpace::ScaleSpace(const SiftKernels& kernels) : blurs_(kOctaveSigma), kernels_(kernels) {}

std::vector<Extremum> ScaleSpace::Build(const cv::Mat& grey, double contrast_threshold,
                                        int threads) {
  contrast_threshold_ = contrast_threshold;
  grey_.Resize(grey.cols, grey.rows);
  for (int y = 0; y < grey.rows; ++y) {
    const uint8_t* from = grey.ptr<uint8_t>(y);
    std::copy(from, from + grey.cols, grey_.row(y));
  }
  int count = 0;
  for (cv::Size size = grey.size() * 2; std::min(size.width, size.height) >= kMinOctaveSide;
       size = {(size.width + 1) / 2, (size.height + 1) / 2}) {
    if (octaves_.size() == static_cast<size_t>(count)) octaves_.emplace_back();
    Octave& octave = octaves_[count++];
    octave.width = size.width;
    octave.height = size.height;
    if (count > 1) octave.base.Resize(size.width, size.height);
    const size_t pixels = static_cast<size_t>(size.width) * size.height;
    for (auto& level : octave.levels) level.resize(std::max(level.size(), pixels));
  }
  std::vector<Extremum> found;
  for (int i = 0; i < count; ++i) BuildOctave(i, i + 1 == count, threads, &found);
  std::sort(found.begin(), found.end(),
            [](const Extremum& a, const Extremum& b) { return Key(a) < Key(b); });
  const auto same = [](const Extremum& a, const Extremum& b) { return Key(a) == Key(b); };
  found.erase(std::unique(found.begin(), found.end(), same), found.end());
  return found;
}

void ScaleSpace::BuildOctave(int index, bool is_last, int threads, std::vector<Extremum>* found) {
  Octave& octave = octaves_[index];
  const FloatRows* grey = index == 0 ? &grey_ : nullptr;
  FloatRows* next_base = is_last ? nullptr : &octaves_[index + 1].base;
  const auto tiles = Tiles(octave.width, octave.height, threads);
  std::vector<std::vector<Extremum>> of_tile(tiles.size());
  const auto run = [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      OctaveTile tile(contrast_threshold_, blurs_, kernels_, grey, index, tiles[i], &octave,
                      next_base);
      of_tile[i] = tile.Run();
    }
  };
  ParallelFor(static_cast<int>(tiles.size()), threads, run);
  for (const auto& some : of_tile) found->insert(found->end(), some.begin(), some.end());
}

KeypointPatch ScaleSpace::Patch(const Extremum& extremum, float angle_rad) const {
  const Octave& octave = octaves_[extremum.octave];
  KeypointPatch patch{};
  patch.pixels = octave.levels[extremum.level - 1].data();
  patch.stride = patch.width = octave.width;
  patch.height = octave.height;
  patch.x = extremum.x;
  patch.y = extremum.y;
  patch.sigma = extremum.sigma;
  patch.angle_rad = angle_rad;
  return patch;
}

}  // namespace skein
