// 3D similarity transformations between the frames of two submaps.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

namespace skein {

// x_target = scale * rotation * x_source + translation. Lengths in the units of either submap.
struct Similarity {
  double scale = 1.0;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d Apply(const Eigen::Vector3d& xyz) const {
    return scale * (rotation * xyz) + translation;
  }
  Similarity Inverse() const;
};

// A camera's pose, cam_from_world as COLMAP has it.
struct CameraPose {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d Apply(const Eigen::Vector3d& xyz) const { return rotation * xyz + translation; }
  Eigen::Vector3d Centre() const { return -(rotation.conjugate() * translation); }
};

// The same camera with its world moved by target_from_source. The scale of the camera's own frame
// follows the world, as in COLMAP: pixels stay where they are.
CameraPose TransformPose(const Similarity& target_from_source, const CameraPose& cam_from_source);

// Least-squares similarity from corresponding points (Umeyama 1991). nullopt for less than three
// pairs. Also when either set of points lies on a line or in a spot: the rotation is open then.
std::optional<Similarity> SimilarityFromPoints(const std::vector<Eigen::Vector3d>& source,
                                               const std::vector<Eigen::Vector3d>& target);

}  // namespace skein
