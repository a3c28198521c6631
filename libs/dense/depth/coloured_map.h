// Depth maps with the colours of their photos, and how well a photo shows a point of the surface.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "depth/dense_points.h"
#include "depth/depth_map.h"

namespace skein {

// A depth map with the colours of its pixels.
struct ColouredMap {
  const DepthMap* map;
  const cv::Mat3b* colours;
  const std::vector<DensePoint>* points;  // of PointsOf; nullptr where only the map matters
  const cv::Mat1b* mask = nullptr;        // 0: the pixel colours no ground; nullptr: none is 0
};

// Median over the maps of the surface that a pixel covers.
double GroundSamplingDistance(const std::vector<ColouredMap>& maps);

// The pixel in which the map shows a point of its camera's frame. nullopt: the map's depth there is
// more than 0.5 % off, the pixel or one beside it is masked, or lies on the map's border.
std::optional<Eigen::Vector2d> PixelThatShows(const ColouredMap& map,
                                              const Eigen::Vector3d& in_camera);

// How well a photo shows the surface at a pixel: s cos a / g. s: distance from the photo's border
// in pixels, a: angle between the surface's normal and the direction to the camera, g: ground
// sampling distance at `depth`.
float ViewScore(const DepthMap& map, const Eigen::Vector2d& pixel, double depth, double cosine);

}  // namespace skein
