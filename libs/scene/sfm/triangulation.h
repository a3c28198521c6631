#pragma once

#include <Eigen/Core>
#include <vector>

#include "sfm/camera.h"
#include "sfm/ids.h"

namespace skein {

// The point that two cameras see, by the inhomogeneous linear method (Hartley and Zisserman 2004,
// section 12.2). Points on the plane at depth 1; the result may lie behind a camera.
Eigen::Vector3d TriangulatePoint(const Matrix3x4d& cam1_from_world,
                                 const Matrix3x4d& cam2_from_world, const Eigen::Vector2d& point1,
                                 const Eigen::Vector2d& point2);

// Angle in radians between the rays of two centres to a point; of an obtuse one the supplement.
double CalculateTriangulationAngle(const Eigen::Vector3d& center1, const Eigen::Vector3d& center2,
                                   const Eigen::Vector3d& point);

// One image's sight of a point.
struct TriangulationView {
  Eigen::Vector2d pixel;
  Eigen::Vector2d on_plane;  // pixel, on the plane at depth 1
  Matrix3x4d cam_from_world;
  Eigen::Vector3d center;
  const Camera* camera = nullptr;  // outlives the estimation
};

struct TriangulationLimits {
  enum class Error { kAngle, kReprojection };  // radians, pixels

  Error error = Error::kAngle;
  double max_error = 0;
};

// The point that most views see, two of them under limits::kMinTriangulationAngleDeg or more, by
// LO-RANSAC over pairs of views; up to 15 views have all their pairs tried. False if no two views
// agree.
bool EstimateTriangulation(const TriangulationLimits& limits,
                           const std::vector<TriangulationView>& views,
                           std::vector<char>* inlier_mask, Eigen::Vector3d* xyz);

}  // namespace skein
