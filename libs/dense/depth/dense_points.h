// The surface that depth maps show, as points.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "depth/depth_map.h"

namespace skein {

struct DensePoint {
  Eigen::Vector3d position;  // in the frame of the poses
  Eigen::Vector3f normal;    // unit, towards the camera
  cv::Vec3b colour;          // blue, green, red
  float relative_error = 0;  // predicted standard error of the depth, part of the depth
};

// The surface's normal at a pixel with a depth, unit, in the camera's frame, towards the camera.
// nullopt without a pixel of the surface beside it and one above or below.
std::optional<Eigen::Vector3d> NormalAt(const DepthMap& map, int x, int y);

// The pixels of a map as points, without those that another map shows with a smaller error: so all
// maps together show each part of the surface once. `colours`: height x width. `others`: maps that
// may show the same surface; each pair of maps must meet both ways. A pixel without neighbours on
// its surface is noise more often than not, and has no normal: it is left out.
std::vector<DensePoint> PointsOf(const DepthMap& map, const cv::Mat3b& colours,
                                 const std::vector<const DepthMap*>& others);

}  // namespace skein
