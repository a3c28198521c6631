#include "features/keypoint_selection.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace skein {
namespace {

constexpr int kCellPx = 64;      // side of a grid cell in pixels of the searched image
constexpr double kSpread = 0.1;  // share of the budget that is dealt evenly to the cells

std::vector<int> StrongestFirst(const std::vector<cv::KeyPoint>& keypoints) {
  std::vector<int> order(keypoints.size());
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&](int i) {
    const auto& k = keypoints[i];
    return std::make_tuple(-k.response, k.pt.y, k.pt.x, k.size, k.angle);
  };
  std::sort(order.begin(), order.end(), [&](int a, int b) { return key(a) < key(b); });
  return order;
}

// Positions in `order`, by cell, each cell strongest first.
std::vector<std::vector<size_t>> Bucket(const std::vector<cv::KeyPoint>& keypoints,
                                        const std::vector<int>& order, size_t first,
                                        cv::Size image_size) {
  const int columns = image_size.width / kCellPx + 1;
  const int rows = image_size.height / kCellPx + 1;
  std::vector<std::vector<size_t>> cells(static_cast<size_t>(columns) * rows);
  for (size_t i = first; i < order.size(); ++i) {
    const cv::Point2f& pt = keypoints[order[i]].pt;
    const int column = std::clamp(static_cast<int>(pt.x) / kCellPx, 0, columns - 1);
    const int row = std::clamp(static_cast<int>(pt.y) / kCellPx, 0, rows - 1);
    cells[static_cast<size_t>(row) * columns + column].push_back(i);
  }
  return cells;
}

}  // namespace

std::vector<int> SelectKeypoints(const std::vector<cv::KeyPoint>& keypoints, cv::Size image_size,
                                 int max_features) {
  std::vector<int> order = StrongestFirst(keypoints);
  const size_t budget = std::max(0, max_features);
  if (order.size() <= budget) return order;

  const size_t by_strength = static_cast<size_t>(std::lround(budget * (1 - kSpread)));
  const auto cells = Bucket(keypoints, order, by_strength, image_size);
  std::vector<size_t> kept(by_strength);
  std::iota(kept.begin(), kept.end(), 0);
  for (size_t round = 0; kept.size() < budget; ++round) {
    std::vector<size_t> dealt;
    for (const auto& cell : cells) {
      if (round < cell.size()) dealt.push_back(cell[round]);
    }
    std::sort(dealt.begin(), dealt.end());
    const size_t taken = std::min(dealt.size(), budget - kept.size());
    kept.insert(kept.end(), dealt.begin(), dealt.begin() + taken);
  }
  std::sort(kept.begin(), kept.end());
  std::vector<int> selected;
  selected.reserve(kept.size());
  for (const size_t i : kept) selected.push_back(order[i]);
  return selected;
}

}  // namespace skein
