#include "depth/warped_view.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "depth/padded_rows.h"

namespace skein {
namespace {

constexpr double kMinScale = 0.4, kMaxScale = 1.9;  // a window of 16 bytes holds 8 columns and one
constexpr double kMaxMargin = 0.75;                 // of the canvas on each side, of the photo's

}  // namespace

double SearchLengthPx(const DepthPhoto& reference, const DepthPhoto& neighbour,
                      const SweepPlanes& planes) {
  WarpedView view(reference.camera, planes);
  view.is_usable_ = view.SetMotion(reference.cam_from_world, neighbour);
  return view.SearchLengthPx();
}

WarpedView::WarpedView(const DepthPhoto& reference, const DepthPhoto& neighbour,
                       const SweepPlanes& planes)
    : WarpedView(reference.camera, planes) {
  is_usable_ = SetMotion(reference.cam_from_world, neighbour);
  if (!is_usable_) return;
  SetSize();
  Render(neighbour);
}

bool WarpedView::SetMotion(const DepthPose& reference, const DepthPhoto& neighbour) {
  const DepthPose& pose = neighbour.cam_from_world;
  const Eigen::Matrix3d rotation = pose.rotation * reference.rotation.transpose();
  const Eigen::Vector3d translation = pose.translation - rotation * reference.translation;
  const Eigen::Matrix3d plane =
      rotation + translation * planes_.Normal(planes_.Middle()).transpose();
  if (std::abs(plane.determinant()) < 1e-3) return false;
  motion_ = plane.partialPivLu().solve(translation);
  neighbour_from_reference_ =
      neighbour.camera.CalibrationOfIndices() * plane * camera_.CalibrationOfIndices().inverse();
  return true;
}

// The canvas holds the reference as every plane moves it, within limits.
void WarpedView::SetSize() {
  double low_x = 0, low_y = 0, high_x = camera_.width, high_y = camera_.height;
  for (const double plane : {planes_.first, planes_.last}) {
    SetPlane(plane);
    if (!is_seen_) continue;
    low_x = std::min(low_x, shift_.x());
    low_y = std::min(low_y, shift_.y());
    high_x = std::max(high_x, shift_.x() + scale_ * camera_.width);
    high_y = std::max(high_y, shift_.y() + scale_ * camera_.height);
  }
  const auto margin = [](double needed, int side) {
    return static_cast<int>(std::min(std::ceil(needed) + 8, kMaxMargin * side + 8));
  };
  left_ = margin(-low_x, camera_.width);
  top_ = margin(-low_y, camera_.height);
  width_ = left_ + camera_.width + margin(high_x - camera_.width, camera_.width);
  height_ = top_ + camera_.height + margin(high_y - camera_.height, camera_.height);
  stride_ = RoundUp(width_ + 2 * kSweepMargin, 64);
}

void WarpedView::Render(const DepthPhoto& neighbour) {
  canvas_.assign(static_cast<size_t>(stride_) * height_, 0);
  cv::Mat1f x(height_, width_), y(height_, width_);
  const float right = static_cast<float>(neighbour.camera.width - 1);
  const float bottom = static_cast<float>(neighbour.camera.height - 1);
  cv::Mat1b seen(height_, width_);
  const Eigen::Vector3f step = neighbour_from_reference_.col(0).cast<float>();
  for (int v = 0; v < height_; ++v) {
    const Eigen::Vector3f first =
        (neighbour_from_reference_ * Eigen::Vector3d(-left_, v - top_, 1)).cast<float>();
    float *to_x = x[v], *to_y = y[v];
    uint8_t* to_seen = seen[v];
    for (int u = 0; u < width_; ++u) {
      const float w = first.z() + static_cast<float>(u) * step.z();
      const float inverse = 1 / (w > 1e-6f ? w : 1e6f);
      to_x[u] = (first.x() + static_cast<float>(u) * step.x()) * inverse;
      to_y[u] = (first.y() + static_cast<float>(u) * step.y()) * inverse;
      to_seen[u] =
          w > 1e-6f && to_x[u] >= 0 && to_y[u] >= 0 && to_x[u] <= right && to_y[u] <= bottom;
    }
  }
  cv::Mat1b canvas(height_, width_, canvas_.data() + kSweepMargin, stride_);
  cv::remap(neighbour.grey, canvas, x, y, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  if (!neighbour.valid.empty()) {
    cv::Mat1b valid;
    cv::remap(neighbour.valid, valid, x, y, cv::INTER_NEAREST, cv::BORDER_CONSTANT, 0);
    seen &= valid;
  }
  FindIntervals(seen);
}

void WarpedView::FindIntervals(const cv::Mat1b& seen) {
  intervals_.assign(height_, {0, 0});
  for (int v = 0; v < height_; ++v) {
    const uint8_t* row = seen[v];
    Interval& longest = intervals_[v];
    for (int u = 0; u < width_;) {
      const int first = u;
      while (u < width_ && row[u] != 0) ++u;
      if (u - first > longest.last - longest.first) longest = {first, u};
      while (u < width_ && row[u] == 0) ++u;
    }
  }
}

double WarpedView::SearchLengthPx() const {
  if (!is_usable_) return 0;
  double longest = 0;
  for (const double x : {0.1, 0.5, 0.9}) {
    for (const double y : {0.1, 0.5, 0.9}) {
      const Eigen::Vector2d ray =
          camera_.Ray(Eigen::Vector2d(x * camera_.width, y * camera_.height));
      longest = std::max(longest, (planes_.last - planes_.first) * Parallax(ray, planes_.Middle()));
    }
  }
  return longest;
}

double WarpedView::Parallax(const Eigen::Vector2d& ray, double plane) const {
  return std::sqrt(SquaredParallax(ray, plane));
}

double WarpedView::SquaredParallax(const Eigen::Vector2d& ray, double plane) const {
  if (!is_usable_) return 0;
  const double w = 1 + (plane - planes_.Middle()) * motion_.z();
  if (w < 1 / kMaxScale) return 0;
  const Eigen::Vector2d moved = motion_.head<2>() - motion_.z() * ray;
  return moved.cwiseProduct(camera_.focal_px).squaredNorm() / (w * w * w * w);
}

void WarpedView::SetPlane(double plane) {
  const double offset = plane - planes_.Middle();
  const double w = 1 + offset * motion_.z();
  is_seen_ = is_usable_ && w > 1 / kMaxScale && w < 1 / kMinScale;
  if (!is_seen_) return;
  scale_ = 1 / w;
  const Eigen::Vector2d middle = camera_.principal_point_px.array() - 0.5;
  const Eigen::Vector2d moved = offset * motion_.head<2>().cwiseProduct(camera_.focal_px);
  shift_ = scale_ * (moved - middle) + middle + Eigen::Vector2d(left_, top_);
  if (canvas_.empty()) return;
  const int count = RoundUp(camera_.width + 2 * kWarpBorder, 2 * kSweepBlock);
  columns_.window.resize(count / kSweepBlock);
  columns_.pairs.resize(2 * count);
  columns_.weights.resize(2 * count);
  // In units of 1 / kWeightUnit pixel, all integers.
  const double highest = kWeightUnit * (width_ - 1) - 1;
  int32_t window = 0;
  for (int i = 0; i < count; ++i) {
    const double at = kWeightUnit * (scale_ * (i - kWarpBorder) + shift_.x());
    const int32_t place = static_cast<int32_t>(std::clamp(at + 0.5, 0.0, highest));
    const int32_t column = place / kWeightUnit, weight = place % kWeightUnit;
    if (i % kSweepBlock == 0) columns_.window[i / kSweepBlock] = window = column;
    columns_.pairs[2 * i] = static_cast<uint8_t>(column - window);
    columns_.pairs[2 * i + 1] = static_cast<uint8_t>(column - window + 1);
    columns_.weights[2 * i] = static_cast<int8_t>(kWeightUnit - weight);
    columns_.weights[2 * i + 1] = static_cast<int8_t>(weight);
  }
}

void WarpedView::FillRow(int y, WarpTask* task) const {
  const double highest = kWeightUnit * (height_ - 1) - 1;
  const int32_t place = static_cast<int32_t>(std::clamp(kWeightUnit * Row(y) + 0.5, 0.0, highest));
  const uint8_t* row = canvas_.data() + static_cast<size_t>(stride_) * (place / kWeightUnit);
  task->above = row + kSweepMargin;
  task->below = row + kSweepMargin + stride_;
  task->below_weight = place % kWeightUnit;
  task->source_width = width_;
  task->window = columns_.window.data();
  task->pairs = columns_.pairs.data();
  task->weights = columns_.weights.data();
  task->width = static_cast<int>(columns_.pairs.size() / 2);
}

WarpedView::Interval WarpedView::IntervalAt(int y) const {
  const double row = Row(y);
  if (!(row >= 0 && row < height_ - 1)) return {0, 0};
  const Interval &above = intervals_[static_cast<int>(row)],
                 &below = intervals_[static_cast<int>(row) + 1];
  return {std::max(above.first, below.first), std::min(above.last, below.last)};
}

bool WarpedView::ShowsRow(int y) const {
  if (!is_seen_) return false;
  const Interval columns = IntervalAt(y);
  return columns.first < columns.last;
}

void WarpedView::Range(int y, int* first, int* last) const {
  *first = *last = 0;
  if (!is_seen_) return;
  Interval common = IntervalAt(y);
  for (const int row : {y - kCensusRadius, y + kCensusRadius}) {
    const Interval other = IntervalAt(row);
    common = {std::max(common.first, other.first), std::min(common.last, other.last)};
  }
  if (common.first >= common.last) return;
  const auto column = [&](int at) { return (at - shift_.x()) / scale_; };
  const double low = column(common.first) + kCensusRadius;
  const double high = column(common.last - 1) - kCensusRadius;
  const double end = camera_.width;
  *first = camera_.width - static_cast<int>(end - std::clamp(low, 0.0, end));  // rounded up
  *last = std::max(*first, static_cast<int>(std::clamp(high, 0.0, end)));
}

}  // namespace skein
