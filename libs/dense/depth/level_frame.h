// A level frame for a model that has no place on the earth.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "depth/coloured_map.h"
#include "depth/depth_map.h"

namespace skein {

// Unit. The direction that is up for who held the cameras: their x axes are level, their centres
// lie about in a plane, their -y axes point up on average. Minimizes
//   mean (u.x)^2 + 0.3 u^T C u / tr C - 0.15 (u.m)^2,
// m: mean of the -y axes, C: covariance of the centres. The sign is that of u.(m - v / 2), v: mean
// view. The live view's page guesses in the same way (web/src/frames.js). z without cameras.
Eigen::Vector3d UpOfCameras(const std::vector<DepthPose>& cameras);

struct LevelFrame {
  // A rotation and a shift: x to the right, y ahead, z up, in the model's unit.
  Eigen::Isometry3d level_from_model = Eigen::Isometry3d::Identity();
  // Share of the points in the ground plane, z = 0. 0: no plane was found; up is UpOfCameras, and
  // z = 0 at the median of the points.
  double ground_share = 0;
};

// Ground plane: most points within 2 % of their median distance from the median point, by RANSAC
// (Fischler and Bolles 1981) and least squares, tilted by at most 30 degrees from UpOfCameras. A
// plane with less than a fifth of the points is none. x is along the longer extent of the ground,
// with the sign by which the cameras look ahead, or have the upper sides of photos there. The
// model's own frame without points. Deterministic.
LevelFrame LevelFrameOf(const std::vector<DepthPose>& cameras,
                        const std::vector<Eigen::Vector3d>& points);

// The same of the maps' cameras, and of at most 20,000 of their points, evenly chosen.
LevelFrame LevelFrameOf(const std::vector<ColouredMap>& maps);

}  // namespace skein
