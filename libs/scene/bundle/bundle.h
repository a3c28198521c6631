#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "core/result.h"

namespace skein {

// A bundle adjustment problem as plain values. The bundle copies all values that it refines, so any
// thread can solve it while the map changes. map/bundle_assembly.h makes one from a map.

// How a free pose's block of the normal equations differs from that of least squares.
struct PoseStiffness {
  // A prior on the pose's increment, centred where it starts: so many times the information that
  // its observations give at the start.
  double rigidity = 0;
  // Multiplies the pose's gradient, and divides its step. Not 1: no least-squares problem any more.
  double gradient_scale = 1;
};

struct BundlePose {
  uint32_t image_id = 0;
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  // cam_from_world
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
  int camera = 0;  // index into Bundle::cameras
  bool constant = false;
  PoseStiffness stiffness;
};

struct BundleCamera {
  uint32_t camera_id = 0;
  int model_id = 0;            // COLMAP's
  std::vector<double> params;  // COLMAP's order
  std::vector<int> refined;    // indices of the parameters that may change
  bool square_pixels = false;  // the second focal length, which is not refined, is the first
  std::vector<double> prior;   // as params: the centre of a weak Gaussian prior
  // As params, in their units, beside observations with a standard deviation of 1 px; 0: no prior.
  std::vector<double> prior_sigma;
};

struct BundlePoint {
  uint64_t point3D_id = 0;
  Eigen::Vector3d xyz = Eigen::Vector3d::Zero();
  int first = 0;  // its observations: [first, first + count)
  int count = 0;
  bool constant = false;
};

struct BundleObservation {
  int pose = 0;  // index into Bundle::poses
  uint32_t point2D_idx = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

struct Bundle {
  std::vector<BundlePose> poses;
  std::vector<BundleCamera> cameras;
  std::vector<BundlePoint> points;
  std::vector<BundleObservation> observations;  // grouped by point
};

class BundleFactor;

enum class Loss { kSquared, kSoftL1, kCauchy };

struct BundleOptions {
  int max_iterations = 25;
  double function_tolerance = 1e-6;  // relative decrease of the cost at which it is converged
  // Step of poses and intrinsics at which it is converged, in their standard deviations (root mean
  // square). 0: only the cost decides.
  double camera_tolerance = 0.01;
  Loss loss = Loss::kSoftL1;
  double loss_scale_px = 1.0;
  int num_threads = 1;
  // The Schur complement as a sparse matrix, however few poses there are; else by what takes less
  // time (ChoosePattern).
  bool is_always_sparse = false;
  const std::atomic<bool>* cancel = nullptr;  // checked at each iteration; the bundle is as it was
  // Called after each iteration if not null: true ends the solution, with the bundle as it is.
  std::function<bool()> stop;
  // Factor of an earlier solution of much the same bundle; null: none. If tracks are long, summing
  // and decomposing the Schur complement takes most of the time. Conjugate gradients with an
  // earlier decomposition as preconditioner do without; they have the same solution.
  std::shared_ptr<const BundleFactor> factor;

  Status Check() const;
};

struct BundleSummary {
  bool usable = false;  // false: numerical failure or cancelled; the bundle is as it was
  int iterations = 0;
  double initial_cost = 0;  // half the sum of the robust squared residuals
  double final_cost = 0;
  int num_free_poses = 0;
  int num_decompositions = 0;
  // For the next solution; null where decomposing again costs little.
  std::shared_ptr<const BundleFactor> factor;
};

// Levenberg-Marquardt on the Schur complement of the points. Pose increments are local, X_cam' =
// exp(w) X_cam - s, so they are independent of the world's frame. The result is the same, bit by
// bit, with any number of threads; sums use four at most. Throws std::invalid_argument on
// nonsensical options, and when indices of the bundle are out of range.
BundleSummary SolveBundle(const BundleOptions& options, Bundle* bundle);

// Reprojection error in pixels of each observation; infinite behind the camera.
std::vector<double> ReprojectionErrors(const Bundle& bundle);

}  // namespace skein
