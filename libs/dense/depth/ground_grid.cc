#include "depth/ground_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace skein {
namespace {

constexpr double kBeyondGrid = 0.002;  // part of the points, on each side of the grid
constexpr double kTopCells =
    2;  // points of a cell's top surface lie so many sides below the highest
constexpr int kFillPasses = 2, kFillNeighbours = 5;
constexpr float kFeather = 0.2f;  // part of the best photo's score
constexpr float kHole = std::numeric_limits<float>::quiet_NaN();

struct Span {
  double low = 0, high = 0;
};

Span SpanOf(std::vector<float>* values) {
  const auto at = [&](double part) {
    const auto nth = values->begin() + static_cast<ptrdiff_t>(part * (values->size() - 1));
    std::nth_element(values->begin(), nth, values->end());
    return double{*nth};
  };
  return {at(kBeyondGrid), at(1 - kBeyondGrid)};
}

// Least side c with (width / c + 1) (height / c + 1) <= most_cells: the positive root of
// (most_cells - 1) c^2 - (width + height) c - width height. Without the cells at the borders a
// grid one cell high would have no bound.
double LeastCell(double width, double height, double most_cells) {
  const double sum = width + height, rest = most_cells - 1;
  return (sum + std::sqrt(sum * sum + 4 * rest * width * height)) / (2 * rest);
}

class GridMaker {
 public:
  GridMaker(const std::vector<ColouredMap>& maps, const Eigen::Isometry3d& level_from_model,
            double cell, double most_cells)
      : maps_(maps), level_from_model_(level_from_model), most_cells_(most_cells) {
    grid_.cell = cell;
  }

  GroundGrid Make() {
    if (!SetSize()) return {};
    SetHeights();
    for (int pass = 0; pass < kFillPasses; ++pass) FillGaps();
    SetFootprints();
    SetBestScores();
    SumColours();
    SetColours();
    return std::move(grid_);
  }

 private:
  // visit(position in the level frame) of all points.
  template <typename Function>
  void ForEachPosition(const Function& visit) const {
    for (const ColouredMap& map : maps_) {
      for (const DensePoint& point : *map.points) {
        visit(Eigen::Vector3f((level_from_model_ * point.position).cast<float>()));
      }
    }
  }

  std::vector<float> Coordinates(int axis) const {
    std::vector<float> values;
    ForEachPosition([&](const Eigen::Vector3f& level) { values.push_back(level[axis]); });
    return values;
  }

  bool SetSize() {
    std::vector<float> x = Coordinates(0), y = Coordinates(1);
    if (x.empty() || !(grid_.cell > 0)) return false;
    const Span east = SpanOf(&x), north = SpanOf(&y);
    const double width = east.high - east.low, height = north.high - north.low;
    grid_.cell = std::max(grid_.cell, LeastCell(width, height, most_cells_));
    grid_.west = east.low;
    grid_.north = north.high;
    const cv::Size size(1 + static_cast<int>(width / grid_.cell),
                        1 + static_cast<int>(height / grid_.cell));
    grid_.height = cv::Mat1f(size, kHole);
    grid_.colour = cv::Mat4b(size, cv::Vec4b());
    return true;
  }

  std::optional<cv::Point> CellOf(const Eigen::Vector3f& position) const {
    const double column = (position.x() - grid_.west) / grid_.cell;
    const double row = (grid_.north - position.y()) / grid_.cell;
    const cv::Size size = grid_.height.size();
    if (!(column >= 0 && row >= 0 && column < size.width && row < size.height)) return std::nullopt;
    return cv::Point(static_cast<int>(column), static_cast<int>(row));
  }

  template <typename Function>
  void ForEachPoint(const Function& function) const {
    ForEachPosition([&](const Eigen::Vector3f& level) {
      if (const auto cell = CellOf(level)) function(*cell, level.z());
    });
  }

  void SetHeights() {
    const cv::Size size = grid_.height.size();
    cv::Mat1f top(size, -std::numeric_limits<float>::infinity()), sum(size, 0.0f);
    cv::Mat1i count(size, 0);
    ForEachPoint([&](const cv::Point& cell, float z) { top(cell) = std::max(top(cell), z); });
    const float depth = static_cast<float>(kTopCells * grid_.cell);
    ForEachPoint([&](const cv::Point& cell, float z) {
      if (z < top(cell) - depth) return;
      sum(cell) += z;
      ++count(cell);
    });
    for (int row = 0; row < size.height; ++row) {
      for (int column = 0; column < size.width; ++column) {
        const int n = count(row, column);
        if (n > 0) grid_.height(row, column) = sum(row, column) / static_cast<float>(n);
      }
    }
  }

  void FillGaps() {
    const cv::Mat1f before = grid_.height.clone();
    for (int row = 1; row + 1 < before.rows; ++row) {
      for (int column = 1; column + 1 < before.cols; ++column) {
        if (!std::isnan(before(row, column))) continue;
        float sum = 0;
        int count = 0;
        for (int k = 0; k < 9; ++k) {
          const float near = before(row - 1 + k / 3, column - 1 + k % 3);
          if (std::isnan(near)) continue;
          sum += near;
          ++count;
        }
        if (count >= kFillNeighbours) grid_.height(row, column) = sum / static_cast<float>(count);
      }
    }
  }

  // ---- Colours ----

  void SetFootprints() {
    for (const ColouredMap& map : maps_) footprints_.push_back(Footprint(*map.map));
  }

  void SetBestScores() {
    best_ = cv::Mat1f(grid_.height.size(), 0.0f);
    for (size_t i = 0; i < maps_.size(); ++i) {
      ForEachSeenCell(i, [&](const cv::Point& cell, const Eigen::Vector2d&, float score) {
        best_(cell) = std::max(best_(cell), score);
      });
    }
  }

  void SumColours() {
    sums_ = cv::Mat4f(grid_.height.size(), cv::Vec4f());
    for (size_t i = 0; i < maps_.size(); ++i) {
      ForEachSeenCell(i, [&](const cv::Point& cell, const Eigen::Vector2d& pixel, float score) {
        const float weight = (score / best_(cell) - (1 - kFeather)) / kFeather;
        if (weight > 0) Add(*maps_[i].colours, pixel, weight, &sums_(cell));
      });
    }
  }

  Eigen::Isometry3d CamFromLevel(const DepthMap& map) const {
    Eigen::Isometry3d cam_from_model = Eigen::Isometry3d::Identity();
    cam_from_model.linear() = map.cam_from_world.rotation;
    cam_from_model.translation() = map.cam_from_world.translation;
    return cam_from_model * level_from_model_.inverse();
  }

  Eigen::Vector3d MiddleOf(int row, int column) const {
    return {grid_.west + (column + 0.5) * grid_.cell, grid_.north - (row + 0.5) * grid_.cell,
            grid_.height(row, column)};
  }

  // visit(cell, pixel, score) of each cell whose surface a map shows.
  template <typename Function>
  void ForEachSeenCell(size_t index, const Function& visit) const {
    const DepthMap& map = *maps_[index].map;
    const cv::Rect& footprint = footprints_[index];
    const Eigen::Isometry3d cam_from_level = CamFromLevel(map);
    const Eigen::Vector3d vertical = cam_from_level.linear().col(2);
    for (int row = footprint.y; row < footprint.br().y; ++row) {
      for (int column = footprint.x; column < footprint.br().x; ++column) {
        if (grid_.IsHole(row, column)) continue;
        const Eigen::Vector3d camera = cam_from_level * MiddleOf(row, column);
        const auto pixel = PixelThatShows(maps_[index], camera);
        if (!pixel) continue;
        const double cosine = std::abs(vertical.dot(camera)) / camera.norm();
        visit(cv::Point(column, row), *pixel, ViewScore(map, *pixel, camera.z(), cosine));
      }
    }
  }

  // The cells that the map's pixels lie in, and those between.
  cv::Rect Footprint(const DepthMap& map) const {
    const Eigen::Isometry3d level_from_cam = CamFromLevel(map).inverse();
    cv::Rect footprint;
    for (int y = 0; y < map.depth.rows; ++y) {
      for (int x = 0; x < map.depth.cols; ++x) {
        if (!(map.depth(y, x) > 0)) continue;
        const Eigen::Vector3d level = level_from_cam * map.Point(x, y);
        const auto cell = CellOf(level.cast<float>());
        if (cell) footprint |= cv::Rect(*cell, cv::Size(1, 1));
      }
    }
    return footprint;
  }

  static void Add(const cv::Mat3b& colours, const Eigen::Vector2d& pixel, float weight,
                  cv::Vec4f* sum) {
    const float x = static_cast<float>(pixel.x() - 0.5), y = static_cast<float>(pixel.y() - 0.5);
    const int left = static_cast<int>(x), top = static_cast<int>(y);
    const float a = x - static_cast<float>(left), b = y - static_cast<float>(top);
    for (int c = 0; c < 3; ++c) {
      const float above = (1 - a) * colours(top, left)[c] + a * colours(top, left + 1)[c];
      const float below = (1 - a) * colours(top + 1, left)[c] + a * colours(top + 1, left + 1)[c];
      (*sum)[c] += weight * ((1 - b) * above + b * below);
    }
    (*sum)[3] += weight;
  }

  void SetColours() {
    for (int row = 0; row < sums_.rows; ++row) {
      for (int column = 0; column < sums_.cols; ++column) {
        const cv::Vec4f& sum = sums_(row, column);
        if (!(sum[3] > 0)) continue;
        cv::Vec4b& colour = grid_.colour(row, column);
        for (int c = 0; c < 3; ++c) colour[c] = cv::saturate_cast<uint8_t>(sum[c] / sum[3]);
        colour[3] = 255;
      }
    }
  }

  const std::vector<ColouredMap>& maps_;
  const Eigen::Isometry3d level_from_model_;
  const double most_cells_;
  GroundGrid grid_;
  std::vector<cv::Rect> footprints_;  // of each map
  cv::Mat1f best_;                    // score of the photo that sees a cell best; 0: no photo does
  cv::Mat4f sums_;                    // weighted colours, weights
};

}  // namespace

bool GroundGrid::IsHole(int row, int column) const { return std::isnan(height(row, column)); }

double GroundGrid::Completeness() const {
  if (colour.empty()) return 0;
  cv::Mat1b alpha;
  cv::extractChannel(colour, alpha, 3);
  return static_cast<double>(cv::countNonZero(alpha)) / alpha.total();
}

GroundGrid MakeGroundGrid(const std::vector<ColouredMap>& maps,
                          const Eigen::Isometry3d& level_from_model, double cell,
                          double most_cells) {
  return GridMaker(maps, level_from_model, cell, most_cells).Make();
}

}  // namespace skein
