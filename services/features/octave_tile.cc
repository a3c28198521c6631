#include "features/octave_tile.h"

#include <algorithm>
#include <cmath>

#include "features/extremum_refinement.h"

namespace skein {
namespace {

// Extrema nearer to the border are left out, as in OpenCV; pixels of the octave.
constexpr int kBorder = 5;
// Rows around an extremum that its refinement reads.
constexpr int kMargin = kMaxRefinementSteps + 1;

int RoundUp(int value, int multiple) { return (value + multiple - 1) / multiple * multiple; }

int Reflect(int y, int height) {
  if (y < 0) y = -y;
  if (y >= height) y = 2 * height - 2 - y;
  return std::clamp(y, 0, height - 1);
}

}  // namespace

OctaveTile::OctaveTile(double contrast_threshold, const OctaveBlurs& blurs,
                       const SiftKernels& kernels, const FloatRows* grey, int octave_index,
                       const cv::Rect& area, Octave* octave, FloatRows* next_base)
    : contrast_threshold_(contrast_threshold),
      blurs_(blurs),
      kernels_(kernels),
      grey_(grey),
      octave_index_(octave_index),
      area_(area),
      octave_(octave),
      next_base_(next_base) {
  int margin = kMargin;
  for (int level = kGaussianLevels - 1; level >= 0; --level) {
    Ring& ring = levels_[level];
    ring.done = std::max(0, area.y - margin);
    ring.end = std::min(octave->height, area.y + area.height + margin);
    if (level > 0) margin += blurs.radius(level);
  }
  levels_[0].done &= ~1;  // rows of the doubled photo are made in pairs
  const int columns = RoundUp(margin + 2 * blurs.first.radius + 2, 16);
  left_ = std::max(0, area.x - columns);
  width_ = std::min(octave->width, area.x + area.width + columns) - left_;

  for (int level = 0; level < kGaussianLevels; ++level) {
    Ring& ring = levels_[level];
    const int radius = level + 1 < kGaussianLevels ? blurs.radius(level + 1) : 0;
    ring.capacity = 2 * radius + 3 * kBlockRows;
    if (level > 0 || grey_) ring.rows.Resize(width_, ring.capacity);
  }
  // A difference is made with its upper level, and needed until the last difference is made.
  int lag = 2 * kMargin + 3 * kBlockRows;
  for (int d = kDogLevels - 1; d >= 0; --d) {
    difference_capacity_[d] = lag;
    differences_[d].Resize(width_, lag);
    lag += blurs.radius(d + 1) + kBlockRows;
  }
  spare_.Resize(width_, 1);
  scratch_.resize(static_cast<size_t>(2 * kOctaveLayers) * (width_ + 3 * kRowPadding));
  found_.resize(static_cast<size_t>(kOctaveLayers) * width_);
}

const float* OctaveTile::LevelRow(int level, int y) const {
  if (level == 0 && !grey_) return octave_->base.row(y) + left_;
  return levels_[level].rows.row(y % levels_[level].capacity);
}

float* OctaveTile::RingRow(Ring* ring, int y, int block_row) {
  const int row = y + block_row;
  return row < ring->end ? ring->rows.row(row % ring->capacity) : spare_.row(0);
}

void OctaveTile::MakeRows(int level, int end) {
  Ring& ring = levels_[level];
  end = std::min(end, ring.end);
  if (level == 0 && !grey_) return;
  while (ring.done < end) {
    const int y = ring.done;
    if (level == 0) {
      DoubleBlock(y);
    } else {
      MakeRows(level - 1, y + kBlockRows + blurs_.radius(level));
      BlurBlock(level, y);
    }
    ring.done = std::min(y + kBlockRows, ring.end);
    if (level < 1 || level > kOctaveLayers) continue;
    for (int row = y; row < ring.done; ++row) KeepRow(level, row);
  }
}

void OctaveTile::DoubleBlock(int y) {
  const int radius = blurs_.first.radius;
  const int height = octave_->height / 2;
  DoubleRows task{};
  for (int k = 0; k < 2 * radius + 3; ++k) {
    task.rows[k] = grey_->row(Reflect(y / 2 - radius + k, height)) + left_ / 2;
  }
  task.even = blurs_.first.even.data();
  task.odd = blurs_.first.odd.data();
  task.radius = radius;
  task.width = width_ / 2;
  task.scratch = scratch_.data();
  for (int i = 0; i < kBlockRows; ++i) task.out[i] = RingRow(&levels_[0], y, i);
  kernels_.double_size(task);
}

void OctaveTile::BlurBlock(int level, int y) {
  const int radius = blurs_.radius(level);
  BlurRows task{};
  for (int k = 0; k < 2 * radius + kBlockRows; ++k) {
    // Rows for outputs behind the last one are any.
    const int row = std::min(y - radius + k, levels_[level].end - 1 + radius);
    task.rows[k] = LevelRow(level - 1, Reflect(row, octave_->height));
  }
  task.weights = blurs_.weights[level].data();
  task.radius = radius;
  task.width = width_;
  task.scratch = scratch_.data();
  for (int i = 0; i < kBlockRows; ++i) {
    task.out[i] = RingRow(&levels_[level], y, i);
    const bool is_spare = y + i >= levels_[level].end;
    FloatRows& difference = differences_[level - 1];
    task.difference[i] =
        is_spare ? spare_.row(0) : difference.row((y + i) % difference_capacity_[level - 1]);
  }
  kernels_.blur(task);
}

void OctaveTile::KeepRow(int level, int y) {
  if (y < area_.y || y >= area_.y + area_.height) return;
  const float* row = LevelRow(level, y) + area_.x - left_;
  const size_t start = static_cast<size_t>(y) * octave_->width + area_.x;
  kernels_.keep(row, area_.width, octave_->levels[level - 1].data() + start);
  if (level != kOctaveLayers || !next_base_ || y % 2 != 0) return;
  float* base = next_base_->row(y / 2);
  for (int x = area_.x + area_.x % 2; x < area_.x + area_.width; x += 2) {
    base[x / 2] = row[x - area_.x];
  }
}

void OctaveTile::SearchRow(int y, std::vector<Extremum>* found) {
  const double min_contrast = 255 * contrast_threshold_ / kOctaveLayers;
  const auto row = [&](int d, int at) { return differences_[d].row(at % difference_capacity_[d]); };
  ExtremaRow task{};
  for (int d = 0; d < kDogLevels; ++d) {
    for (int k = 0; k < 3; ++k) task.rows[d][k] = row(d, y - 1 + k);
  }
  task.first = std::max(area_.x, kBorder) - left_;
  task.last = std::min(area_.x + area_.width, octave_->width - kBorder) - left_;
  // The refined value may be higher; as in OpenCV half is enough to be looked at.
  task.threshold = static_cast<float>(0.5 * min_contrast);
  task.scratch = scratch_.data();
  if (task.first >= task.last) return;
  const int count = kernels_.find_extrema(task, found_.data());
  if (count == 0) return;
  DogRows rows{};
  for (int d = 0; d < kDogLevels; ++d) {
    for (int k = 0; k < 2 * kMargin + 1; ++k) rows.rows[d][k] = row(d, y - kMargin + k);
  }
  for (int i = 0; i < count; ++i) {
    const auto refined = Refine(rows, found_[i], min_contrast, kEdgeThreshold);
    if (!refined) continue;
    Extremum extremum;
    extremum.octave = octave_index_;
    extremum.level = refined->layer;
    // The whole pixels first: of two extrema that end at one place all digits are the same.
    extremum.x = static_cast<float>(left_ + found_[i].column + refined->dx) + refined->step.x;
    extremum.y = static_cast<float>(y + refined->dy) + refined->step.y;
    const double layer = refined->layer + double{refined->step.s};
    extremum.sigma = static_cast<float>(kOctaveSigma * std::exp2(layer / kOctaveLayers));
    extremum.contrast = std::abs(refined->contrast) / 255;
    found->push_back(extremum);
  }
}

std::vector<Extremum> OctaveTile::Run() {
  std::vector<Extremum> found;
  for (int y = area_.y; y < area_.y + area_.height; ++y) {
    MakeRows(kGaussianLevels - 1, y + kMargin + 1);
    if (y >= kBorder && y < octave_->height - kBorder) SearchRow(y, &found);
  }
  return found;
}

}  // namespace skein
