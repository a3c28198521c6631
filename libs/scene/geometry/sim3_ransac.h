// Similarity between two submaps from the photos that both hold: SfM on-the-fly v2, section 3.4,
// Algorithm 3. Two departures make collinear and coincident camera centres work:
//  - A hypothesis never rests on camera centres alone. Its source is either 3D points that both
//    submaps see through the same (image, point2D), or whole poses: rotation from rotations, scale
//    from the depths of common points.
//  - The best hypothesis is refined on the symmetric reprojection error of all inliers.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/limits.h"
#include "core/result.h"
#include "geometry/sim3_similarity.h"
#include "sfm/camera.h"

namespace skein {

// One photo as one submap holds it.
struct SharedView {
  struct Observation {
    Eigen::Vector3d xyz;    // in the submap's frame
    Eigen::Vector2d pixel;  // where the photo sees it, COLMAP's convention
  };
  int64_t image_id = 0;
  Camera camera;
  CameraPose cam_from_world;
  std::unordered_map<uint32_t, Observation> observations;  // by point2D index
};

// One photo as both submaps hold it, with the points that both see through it.
struct SharedPhoto {
  struct CommonPoint {
    uint32_t point2D_idx = 0;
    Eigen::Vector3d source_xyz;
    Eigen::Vector3d target_xyz;
    Eigen::Vector2d pixel;
  };
  int64_t image_id = 0;
  Camera source_camera;
  Camera target_camera;
  CameraPose cam_from_source;
  CameraPose cam_from_target;
  std::vector<CommonPoint> points;  // by point2D index
};

// Photos of both lists, by image id. Views with an invalid camera are left out.
std::vector<SharedPhoto> PairSharedViews(const std::vector<SharedView>& source,
                                         const std::vector<SharedView>& target);

// max_re: largest reprojection error of an inlier, for a photo whose longer side is 1,600 px. The
// limit scales with the photo's longer side.
constexpr double kMaxSim3ErrorPx = limits::kMaxPoseErrorPx;
// num_trials. Triples are enumerated when there are no more than that.
constexpr int kNumSim3Trials = 1000;
// Common points of one photo that score a hypothesis; the final score takes all.
constexpr int kMaxScoredPoints = 150;

struct Sim3Options {
  // Share of a photo's common points that must reproject in both directions (min_ior).
  double min_inlier_ratio = 0.3;
  // Photos that must agree: 3, but for the joining of submaps that will never share more.
  int min_inlier_images = 3;
  // A photo with fewer common points is no evidence.
  int min_common_points = 8;
  uint64_t seed = 0;

  // An error names the value and what to give.
  Status Check() const;
};

struct Sim3Result {
  bool success = false;
  std::string reason;  // why not
  Similarity target_from_source;
  std::vector<int64_t> inlier_image_ids;  // ascending
  int num_usable_images = 0;              // with enough common points: they may agree
  int num_common_points = 0;
  int num_inlier_points = 0;   // in inlier photos
  double mean_error_px = 0.0;  // mean of both directions over the inlier points
  int num_trials = 0;
};

// Deterministic for equal input and seed.
Sim3Result EstimateSim3(const std::vector<SharedPhoto>& shared, const Sim3Options& options);

// Refines a known similarity, e.g. of the same submaps before they were adjusted, on its inliers.
// Fails where fewer photos than options.min_inlier_images agree with it.
Sim3Result RefineSim3From(const Similarity& initial, const std::vector<SharedPhoto>& shared,
                          const Sim3Options& options);

}  // namespace skein
