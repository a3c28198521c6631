#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>

namespace skein {

// Ids as COLMAP's files have them. The largest value means "none".
using CameraId = uint32_t;
using ImageId = uint32_t;
using Point2DIdx = uint32_t;  // of a keypoint within its image
using Point3DId = uint64_t;

constexpr CameraId kInvalidCameraId = std::numeric_limits<CameraId>::max();
constexpr ImageId kInvalidImageId = std::numeric_limits<ImageId>::max();
constexpr Point2DIdx kInvalidPoint2DIdx = std::numeric_limits<Point2DIdx>::max();
constexpr Point3DId kInvalidPoint3DId = std::numeric_limits<Point3DId>::max();

using Matrix3x4d = Eigen::Matrix<double, 3, 4>;  // [R | t]
using Rgb = Eigen::Matrix<uint8_t, 3, 1>;

}  // namespace skein
