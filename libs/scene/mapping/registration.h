#pragma once

#include <optional>
#include <vector>

#include "bundle/bundle.h"
#include "core/limits.h"
#include "core/result.h"
#include "disambiguation/photo_groups.h"
#include "disambiguation/similar_structures.h"
#include "map/scene_map.h"
#include "mapping/pose_sigmas.h"
#include "mapping/refusal.h"

namespace skein {

// Share of the verified matches with registered photos that must agree with the refined pose
// (placement.h).
constexpr double kMinEpipolarShare = 0.65;

// 2D-3D correspondences of a photo with a map.
struct VisiblePoints {
  std::vector<Point2DIdx> point2D_idxs;
  std::vector<Point3DId> point3D_ids;
  std::vector<Eigen::Vector2d> pixels;
  std::vector<Eigen::Vector3d> xyz;
  size_t size() const { return pixels.size(); }
};

// Through the verified matches with registered photos, each (keypoint, point) once.
VisiblePoints FindVisiblePoints(const SceneMap& map, ImageId image_id);

// Earlier findings on a photo that decide how strictly its pose is judged.
struct TrialContext {
  // The photo, or one that it matches, was found to show a visually similar place: it is judged by
  // missing cells, too.
  bool matches_similar_place = false;
  bool needs_min_cells = false;  // at least kMinCells must count
};

struct PoseEstimate {
  bool ok = false;
  Refusal refusal;                          // why not
  bool has_too_many_missing_cells = false;  // similar_structures.h
  int num_visible = 0;
  int num_inliers = 0;
  BundlePose pose;                    // cam_from_world
  std::vector<double> camera_params;  // as given, or refined with the pose
  bool has_own_camera = false;        // its camera's photos have others, or each its own
  std::vector<char> inlier_mask;      // of the visible points
  PoseSigmas sigmas;                  // the points taken for certain
};

// Absolute pose by LO-RANSAC (P3P, refined by EPnP; COLMAP's estimator) and a robust non-linear
// refinement. The camera's focal length and distortion are estimated along when no other photo of
// it is registered; also where their intrinsics, without a focal length from EXIF, do not fit the
// photo and others of its own do. Changes nothing in the map. The same input gives the same result.
PoseEstimate EstimatePose(const SceneMap& map, ImageId image_id, const VisiblePoints& visible,
                          const TrialContext& context = {});

// Pose (cam_from_world) of a registered photo by its matches with one other registered photo alone,
// with its camera as it is. nullopt if fewer than limits::kMinPoseInliers agree.
std::optional<Matrix3x4d> EstimatePoseByPair(const SceneMap& map, ImageId image_id, ImageId other);

// Whether the sigmas are within `factor` times their limits.
bool IsDetermined(const PoseSigmas& sigmas, double factor = 1);

// The photo's verified matches with registered photos. A match agrees if its Sampson error under
// the pose is at most limits::kMaxErrorPx.
Votes EpipolarVotes(const SceneMap& map, ImageId image_id, const Camera& camera,
                    const BundlePose& pose);

// The same with the pose and camera of a registered photo.
Votes EpipolarVotes(const SceneMap& map, ImageId image_id);

// The same of the matches of two registered photos alone.
Votes EpipolarVotes(const SceneMap& map, ImageId id1, ImageId id2);

// Whether most points of a registered photo's matches are outliers of its pose and agree on another
// pose. Some outliers suffice if the photo has a camera of its own, or should have one: the photo
// may have settled for a wrong focal length and distance, where bundle adjustment finds no way out.
bool FitsElsewhere(const SceneMap& map, ImageId image_id, const VisiblePoints& visible);

// Whether a pose that is estimated from nothing differs from that of a registered photo and has a
// lower robust cost over the visible points. Two poses nearly fit points of one plane, and bundle
// adjustment finds no way from one to the other.
bool HasBetterPose(const SceneMap& map, ImageId image_id);

// Registers the photo with the pose and continues the inliers' tracks.
void RegisterWithPose(const PoseEstimate& estimate, const VisiblePoints& visible, ImageId image_id,
                      SceneMap* map);

// Seed for the thread's random numbers, from the ids of what is estimated.
unsigned SeedFromIds(uint64_t a, uint64_t b);

}  // namespace skein
