#include "depth/coloured_map.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/statistics.h"

namespace skein {
namespace {

// Part of the depth. With 0.02 the dolphin of fountain-P11 coloured the wall behind it.
constexpr float kSeenDepth = 0.005f;

// Whether the mask is 0 at one of the four pixels around.
bool IsMasked(const cv::Mat1b& mask, const Eigen::Vector2d& pixel) {
  const int left = static_cast<int>(pixel.x() - 0.5), top = static_cast<int>(pixel.y() - 0.5);
  return std::min({mask(top, left), mask(top, left + 1), mask(top + 1, left),
                   mask(top + 1, left + 1)}) == 0;
}

}  // namespace

double GroundSamplingDistance(const std::vector<ColouredMap>& maps) {
  std::vector<double> sizes;
  for (const ColouredMap& map : maps) {
    const double size = map.map->MedianDepth() / map.map->camera.focal_px.x();
    if (size > 0) sizes.push_back(size);
  }
  return UpperMedian(std::move(sizes));
}

std::optional<Eigen::Vector2d> PixelThatShows(const ColouredMap& map,
                                              const Eigen::Vector3d& in_camera) {
  if (!(in_camera.z() > 0)) return std::nullopt;
  const cv::Mat1f& depths = map.map->depth;
  const Eigen::Vector2d pixel = map.map->camera.Pixel(in_camera.hnormalized());
  if (!(pixel.minCoeff() >= 1 && pixel.x() < depths.cols - 1 && pixel.y() < depths.rows - 1)) {
    return std::nullopt;
  }
  const float depth = depths(static_cast<int>(pixel.y()), static_cast<int>(pixel.x()));
  const float z = static_cast<float>(in_camera.z());
  if (!(std::abs(depth - z) <= kSeenDepth * z)) return std::nullopt;
  if (map.mask != nullptr && IsMasked(*map.mask, pixel)) return std::nullopt;
  return pixel;
}

float ViewScore(const DepthMap& map, const Eigen::Vector2d& pixel, double depth, double cosine) {
  const double border =
      std::min({pixel.x(), pixel.y(), map.depth.cols - pixel.x(), map.depth.rows - pixel.y()});
  return static_cast<float>(border * cosine * map.camera.focal_px.x() / depth);
}

}  // namespace skein
