// Points as LAS files.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "core/result.h"
#include "geometry/georeference.h"

namespace skein {

struct LasPoint {
  Eigen::Vector3d position;
  cv::Vec3b colour;  // blue, green, red
};

// LAS 1.2, point format 2 (colours, 16 bit a channel). With `origin`, positions are metres to the
// east, north and up of it: coordinates are those of local_projection.h, in steps of 1 mm, and the
// origin's altitude is added to heights, if it has one. Without `origin`, coordinates are
// positions, in steps of at most a millionth of their extent, and have no coordinate system. Takes
// 26 bytes a point. The file appears when it is whole. Error: no points, more than 2^32, an extent
// of more than 2,000 km, or the file cannot be written.
Status WriteLas(const std::vector<LasPoint>& points, const std::optional<GeodeticPosition>& origin,
                const std::filesystem::path& file);

}  // namespace skein
