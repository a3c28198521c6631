#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "sfm/ransac.h"

namespace skein {

// The pose of a camera of unknown focal length, from five points and where they are in the photo.
// Points lie in their pixel's direction from the principal point, whatever the focal length and the
// radial distortion: five such equations give the pose but for the distance along the optical axis,
// up to four times. The distances from the principal point then give that and the focal length by
// least squares. Kukelova, Bujnak and Pajdla, "Real-time solution to the absolute pose problem with
// unknown radial distortion and focal length" (ICCV 2013); here without their distortion.
// An estimator for COLMAP's RANSAC (colmap_api.h).
class FocalPoseEstimator {
 public:
  using X_t = Eigen::Vector2d;  // px, from the principal point
  using Y_t = Eigen::Vector3d;  // in the world
  struct M_t {
    Eigen::Matrix<double, 3, 4> cam_from_world = Eigen::Matrix<double, 3, 4>::Zero();
    double focal_px = 0;
  };
  static constexpr int kMinNumSamples = 5;

  // The poses with all five points before the camera.
  static std::vector<M_t> Estimate(const std::vector<X_t>& pixels, const std::vector<Y_t>& points);
  // Squared distances in px; infinite for a point behind the camera.
  static void Residuals(const std::vector<X_t>& pixels, const std::vector<Y_t>& points,
                        const M_t& model, std::vector<double>* residuals);
};

// The focal length with which most points fit a pose; none if no pose has three times the points
// that it takes. `pixels` are from the principal point. Uses the thread's random numbers.
std::optional<double> EstimateFocalLength(const RansacLimits& limits,
                                          const std::vector<Eigen::Vector2d>& pixels,
                                          const std::vector<Eigen::Vector3d>& points);

}  // namespace skein
