#include "depth/hillshade.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/angles.h"

namespace skein {
namespace {

constexpr double kAzimuthDeg = 315, kAltitudeDeg = 45;  // of the light: custom of maps
constexpr double kDarkest = 1, kShades = 254;           // 0 is a hole

// Unit, to the east, north and up.
Eigen::Vector3d TowardsLight() {
  const double azimuth = DegToRad(kAzimuthDeg), altitude = DegToRad(kAltitudeDeg);
  return {std::cos(altitude) * std::sin(azimuth), std::cos(altitude) * std::cos(azimuth),
          std::sin(altitude)};
}

class Shader {
 public:
  Shader(const cv::Mat1f& height, double cell)
      : height_(height), eight_cells_(8 * cell), light_(TowardsLight()) {}

  uint8_t ShadeOf(int row, int column) const {
    if (std::isnan(height_(row, column))) return 0;
    const double cosine = NormalAt(row, column).dot(light_);
    return cv::saturate_cast<uint8_t>(kDarkest + kShades * std::max(0.0, cosine));
  }

 private:
  Eigen::Vector3d NormalAt(int row, int column) const {
    const auto at = [&](int down, int right) { return Neighbour(row, column, down, right); };
    const double east = at(-1, 1) + 2 * at(0, 1) + at(1, 1);
    const double west = at(-1, -1) + 2 * at(0, -1) + at(1, -1);
    const double north = at(-1, -1) + 2 * at(-1, 0) + at(-1, 1);
    const double south = at(1, -1) + 2 * at(1, 0) + at(1, 1);
    return Eigen::Vector3d((west - east) / eight_cells_, (south - north) / eight_cells_, 1)
        .normalized();
  }

  double Neighbour(int row, int column, int down, int right) const {
    const float near = HeightAt(row + down, column + right);
    if (!std::isnan(near)) return near;
    const double centre = height_(row, column);
    const float opposite = HeightAt(row - down, column - right);
    if (!std::isnan(opposite)) return 2 * centre - opposite;
    const bool is_diagonal = down != 0 && right != 0;
    if (!is_diagonal) return centre;
    return Neighbour(row, column, down, 0) + Neighbour(row, column, 0, right) - centre;
  }

  float HeightAt(int row, int column) const {
    const bool is_inside = row >= 0 && column >= 0 && row < height_.rows && column < height_.cols;
    return is_inside ? height_(row, column) : std::numeric_limits<float>::quiet_NaN();
  }

  const cv::Mat1f& height_;
  const double eight_cells_;
  const Eigen::Vector3d light_;
};

}  // namespace

cv::Mat1b Hillshade(const cv::Mat1f& height, double cell) {
  const Shader shader(height, cell);
  cv::Mat1b shades(height.size());
  for (int row = 0; row < height.rows; ++row) {
    for (int column = 0; column < height.cols; ++column) {
      shades(row, column) = shader.ShadeOf(row, column);
    }
  }
  return shades;
}

}  // namespace skein
