#include "mapping/registration.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_map>
#include <utility>

#include "core/angles.h"
#include "core/statistics.h"
#include "map/bundle_builder.h"
#include "map/image_pose.h"
#include "sfm/absolute_pose.h"
#include "sfm/focal_length.h"
#include "sfm/pose.h"
#include "sfm/projection.h"
#include "sfm/random.h"
#include "sfm/two_view_geometry.h"

namespace skein {
namespace {

// COLMAP's, of an absolute pose: share of the visible points that must be inliers; RANSAC.
constexpr double kMinInlierRatio = 0.25;
constexpr int kMinNumTrials = 100, kMaxNumTrials = 10000;
constexpr double kConfidence = 0.99999;

// RANSAC runs at each. Two poses can share their inliers at the widest limit, e.g. of a nearly
// planar part of the scene. The smaller limits tell them apart.
constexpr double kRansacLimitsPx[] = {limits::kMaxPoseErrorPx, limits::kMaxErrorPx, 2.0};

// Largest standard deviations of a refined pose (pose_sigmas.h). Deviations grow when the points
// lie in one corner, on a line or too far away.
constexpr double kMaxSigmaOfPosition = 0.02;
constexpr double kMaxSigmaOfFramePx = 2 * limits::kMaxErrorPx;

// Focal lengths taken, as a factor of the prior, for a camera that has none from EXIF and was never
// refined. The bounds cover 17 to 108 mm equivalents of a guess of 1.2; COLMAP takes 0.1 to 10.
constexpr double kMinFocalFactor = 0.4, kMaxFocalFactor = 2.5;

// A pose that is less determined than required by this factor can start a refinement with the
// photo's other matches.
constexpr double kSigmasOfAStart = 5;

// Part of the points that its matches tie it to that a photo observes if it stands right: with
// intrinsics that other photos determine, too, and with intrinsics of its own. Of 150 photos of 150
// cameras those with focal lengths within 3 % observed 0.8 or more, 0.98 in the median.
constexpr double kMinObserved = 0.5, kMinObservedAlone = 0.85;

// Poses that differ by more are poses of two places. The position is over the median depth.
constexpr double kElsewherePosition = 0.05, kElsewhereDeg = 5;

// A search looks at no more points, whether for a pose, a better one or a focal length: of a
// quarter of them, kMinInlierRatio, 125 tell a pose. The refinement then takes all.
constexpr size_t kMaxSearchPoints = 500;

// One free pose, all points constant.
Bundle PoseOnlyBundle(const SceneMap& map, const Camera& camera, bool refine_camera,
                      const VisiblePoints& visible, const PoseEstimate& estimate) {
  Bundle bundle;
  bundle.poses.push_back(estimate.pose);
  bundle.cameras.push_back(MakeBundleCamera(map, camera.CameraId(), refine_camera, refine_camera));
  bundle.cameras[0].params = camera.Params();
  for (size_t i = 0; i < visible.size(); ++i) {
    if (!estimate.inlier_mask[i]) continue;
    BundlePoint point;
    point.xyz = visible.xyz[i];
    point.first = static_cast<int>(bundle.observations.size());
    point.count = 1;
    point.constant = true;
    bundle.points.push_back(point);
    bundle.observations.push_back({0, visible.point2D_idxs[i], visible.pixels[i]});
  }
  ScalePriors(&bundle);
  return bundle;
}

// y' E x = 0 for x in the photo of `pose` and y in `other`, on the plane at depth 1.
Eigen::Matrix3d EssentialMatrix(const BundlePose& pose, const Image& other) {
  const Eigen::Matrix3d R = other.RotationMatrix() * pose.R.transpose();
  const Eigen::Vector3d t = (other.Tvec() - R * pose.t).normalized();
  return CrossProductMatrix(t) * R;
}

double SampsonError(const Eigen::Matrix3d& E, const Eigen::Vector3d& x, const Eigen::Vector3d& y) {
  const Eigen::Vector3d line_y = E * x, line_x = E.transpose() * y;
  const double norm = std::sqrt(line_y.head<2>().squaredNorm() + line_x.head<2>().squaredNorm());
  return norm > 0 ? std::abs(y.dot(line_y)) / norm : HUGE_VAL;
}

// What is estimated of a photo's camera along with its pose.
struct CameraUse {
  bool estimate_focal = false;  // again
  bool refine = false;          // focal length and distortion
};

PoseEstimate Refuse(PoseEstimate estimate, Refusal::Cause cause, const std::string& text) {
  estimate.ok = false;
  estimate.refusal = {cause, text};
  return estimate;
}

RansacLimits LimitsOf(double max_error_px) {
  RansacLimits limits;
  limits.max_error = max_error_px;
  limits.min_inlier_ratio = kMinInlierRatio;
  limits.min_num_trials = kMinNumTrials;
  limits.max_num_trials = kMaxNumTrials;
  limits.confidence = kConfidence;
  return limits;
}

// Evenly spread ones, kMaxSearchPoints at most.
VisiblePoints Thinned(const VisiblePoints& visible) {
  const size_t step = (visible.size() + kMaxSearchPoints - 1) / kMaxSearchPoints;
  VisiblePoints some;
  for (size_t i = 0; i < visible.size(); i += step) {
    some.point2D_idxs.push_back(visible.point2D_idxs[i]);
    some.point3D_ids.push_back(visible.point3D_ids[i]);
    some.pixels.push_back(visible.pixels[i]);
    some.xyz.push_back(visible.xyz[i]);
  }
  return some;
}

// The points that the pose shows within `max_error_px` of their pixels.
void MarkInliers(const Camera& camera, double max_error_px, const VisiblePoints& visible,
                 PoseEstimate* estimate) {
  estimate->num_inliers = 0;
  estimate->inlier_mask.resize(visible.size());
  for (size_t i = 0; i < visible.size(); ++i) {
    Eigen::Vector2d pixel;
    const bool inlier = Project(camera.ModelId(), camera.Params(),
                                estimate->pose.R * visible.xyz[i] + estimate->pose.t, &pixel) &&
                        (pixel - visible.pixels[i]).norm() <= max_error_px;
    estimate->inlier_mask[i] = inlier;
    estimate->num_inliers += inlier;
  }
}

bool RunRansac(double max_error_px, const VisiblePoints& visible, const Camera& camera,
               PoseEstimate* estimate) {
  const VisiblePoints some = Thinned(visible);
  const auto pose = EstimateAbsolutePose(LimitsOf(max_error_px), some.pixels, some.xyz, camera);
  if (!pose) return false;
  estimate->pose.R = pose->R;
  estimate->pose.t = pose->t;
  MarkInliers(camera, max_error_px, visible, estimate);
  return true;
}

// Sets the camera's focal length to the one with which most points fit a pose.
bool FindFocalLength(double max_error_px, const VisiblePoints& visible, Camera* camera) {
  const Eigen::Vector2d center(camera->PrincipalPointX(), camera->PrincipalPointY());
  VisiblePoints some = Thinned(visible);
  for (Eigen::Vector2d& pixel : some.pixels) pixel -= center;
  const std::optional<double> found =
      EstimateFocalLength(LimitsOf(max_error_px), some.pixels, some.xyz);
  if (!found) return false;
  const double factor = *found / camera->MeanFocalLength();
  if (factor < kMinFocalFactor || factor > kMaxFocalFactor) return false;
  for (const size_t i : camera->FocalLengthIdxs()) camera->Params(i) *= factor;
  return true;
}

// Refines pose (and camera) on the inliers; counts them again at the refined pose.
bool Refine(const SceneMap& map, bool refine_camera, const VisiblePoints& visible, Camera* camera,
            PoseEstimate* estimate) {
  Bundle bundle = PoseOnlyBundle(map, *camera, refine_camera, visible, *estimate);
  BundleOptions solve;
  solve.loss = Loss::kCauchy;
  solve.max_iterations = 100;
  if (!SolveBundle(solve, &bundle).usable) return false;
  estimate->pose = bundle.poses[0];
  camera->SetParams(bundle.cameras[0].params);
  MarkInliers(*camera, limits::kMaxPoseErrorPx, visible, estimate);
  estimate->sigmas = SigmasOfFirstPose(PoseOnlyBundle(map, *camera, false, visible, *estimate));
  return true;
}

// Robust cost over all visible points, in px^2. An outlier costs as much as an error at the inlier
// limit.
double RobustCost(const Camera& camera, const VisiblePoints& visible, const BundlePose& pose) {
  double cost = 0;
  for (size_t i = 0; i < visible.size(); ++i) {
    double error = limits::kMaxPoseErrorPx;
    Eigen::Vector2d pixel;
    if (Project(camera.ModelId(), camera.Params(), pose.R * visible.xyz[i] + pose.t, &pixel)) {
      error = std::min(error, (pixel - visible.pixels[i]).norm());
    }
    cost += std::log1p(error * error);
  }
  return cost;
}

struct Candidate {
  PoseEstimate estimate;
  Camera camera;
  double cost = HUGE_VAL;  // none was found
};

// The refined pose with the least robust cost of those with most inliers at each limit of RANSAC.
Candidate BestAtAnyLimit(const SceneMap& map, const CameraUse& use, const VisiblePoints& visible,
                         const Candidate& none) {
  Candidate best = none;
  for (const double limit_px : kRansacLimitsPx) {
    Candidate candidate = none;
    if ((use.estimate_focal && !FindFocalLength(limit_px, visible, &candidate.camera)) ||
        !RunRansac(limit_px, visible, candidate.camera, &candidate.estimate) ||
        candidate.estimate.num_inliers < limits::kMinPoseInliers ||
        !Refine(map, use.refine, visible, &candidate.camera, &candidate.estimate)) {
      continue;
    }
    candidate.cost = RobustCost(candidate.camera, visible, candidate.estimate.pose);
    if (candidate.cost < best.cost) best = candidate;
  }
  return best;
}

bool FitsWell(const PoseEstimate& estimate, const VisiblePoints& visible) {
  return estimate.num_inliers >= kMinObservedAlone * visible.size();
}

// Photos of one agent and size without EXIF count as of one camera, which is a guess.
bool MayBeOfSeveralCameras(const CameraState& state) {
  return !state.fixed && !state.focal_from_exif;
}

// A focal length from EXIF is wrong where the photo was cropped. Then many points don't fit, and
// others are searched, too. So it is where the photo is not of the camera whose intrinsics other
// photos have told.
Candidate FindPose(const SceneMap& map, const CameraUse& use, const VisiblePoints& visible,
                   const Candidate& none) {
  const Candidate best = BestAtAnyLimit(map, use, visible, none);
  const CameraState& state = map.camera_state(none.camera.CameraId());
  const bool gets_own_camera = !use.refine;
  if (use.estimate_focal || FitsWell(best.estimate, visible) ||
      (gets_own_camera && !MayBeOfSeveralCameras(state))) {
    return best;
  }
  Candidate searched = none;
  searched.camera.SetParams(state.prior_params);
  searched = BestAtAnyLimit(map, {true, true}, visible, searched);
  searched.estimate.has_own_camera = gets_own_camera;
  if (gets_own_camera && !FitsWell(searched.estimate, visible)) return best;
  return searched.cost < best.cost ? searched : best;
}

double MedianDepth(const VisiblePoints& visible, const PoseEstimate& estimate) {
  std::vector<double> depths;
  for (size_t i = 0; i < visible.size(); ++i) {
    if (!estimate.inlier_mask[i]) continue;
    depths.push_back((estimate.pose.R * visible.xyz[i] + estimate.pose.t).z());
  }
  return UpperMedian(std::move(depths));
}

bool Differ(const VisiblePoints& visible, const PoseEstimate& estimate, const BundlePose& other) {
  const Eigen::Vector3d center = -(estimate.pose.R.transpose() * estimate.pose.t);
  const Eigen::Vector3d other_center = -(other.R.transpose() * other.t);
  const double angle = Eigen::AngleAxisd(estimate.pose.R * other.R.transpose()).angle();
  return (center - other_center).norm() > kElsewherePosition * MedianDepth(visible, estimate) ||
         RadToDeg(angle) > kElsewhereDeg;
}

// No other registered photo says what the camera's intrinsics are.
bool MayEstimateCamera(const SceneMap& map, ImageId image_id) {
  const Image& image = map.reconstruction().Image(image_id);
  const CameraState& state = map.camera_state(image.CameraId());
  if (state.fixed) return false;
  if (image.IsRegistered()) return state.num_registered == 1;
  return state.num_registered == 0 && !state.refined;
}

}  // namespace

std::optional<Matrix3x4d> EstimatePoseByPair(const SceneMap& map, ImageId image_id, ImageId other) {
  const Reconstruction& model = map.reconstruction();
  VisiblePoints visible;
  for (const auto& match : map.MatchesOfPair(image_id, other)) {
    const Point2D& theirs = model.Image(other).Point2D(match.point2D_idx2);
    if (!theirs.HasPoint3D()) continue;
    visible.point2D_idxs.push_back(match.point2D_idx1);
    visible.point3D_ids.push_back(theirs.Point3DId());
    visible.pixels.push_back(model.Image(image_id).Point2D(match.point2D_idx1).XY());
    visible.xyz.push_back(model.Point3D(theirs.Point3DId()).XYZ());
  }
  if (static_cast<int>(visible.size()) < limits::kMinPoseInliers) return std::nullopt;
  SetRandomSeed(SeedFromIds(image_id, other));
  const Camera& camera = model.Camera(model.Image(image_id).CameraId());
  PoseEstimate estimate;
  if (!RunRansac(limits::kMaxPoseErrorPx, visible, camera, &estimate) ||
      estimate.num_inliers < limits::kMinPoseInliers) {
    return std::nullopt;
  }
  return ComposeProjectionMatrix(estimate.pose.R, estimate.pose.t);
}

bool IsDetermined(const PoseSigmas& sigmas, double factor) {
  return sigmas.position <= factor * kMaxSigmaOfPosition &&
         sigmas.frame_px <= factor * kMaxSigmaOfFramePx;
}

Votes EpipolarVotes(const SceneMap& map, ImageId image_id, const Camera& camera,
                    const BundlePose& pose) {
  const Reconstruction& reconstruction = map.reconstruction();
  const Image& image = reconstruction.Image(image_id);
  const double max_error = limits::kMaxErrorPx / camera.MeanFocalLength();
  std::unordered_map<ImageId, Eigen::Matrix3d> essentials;  // other from this
  Votes votes;
  for (Point2DIdx i = 0; i < image.NumPoints2D(); ++i) {
    const auto& correspondences = map.graph().FindCorrespondences(image_id, i);
    if (correspondences.empty()) continue;
    const Eigen::Vector3d x = camera.ImageToWorld(image.Point2D(i).XY()).homogeneous();
    for (const auto& correspondence : correspondences) {
      const Image& other = reconstruction.Image(correspondence.image_id);
      if (!other.IsRegistered()) continue;
      const auto [entry, is_new] = essentials.try_emplace(correspondence.image_id);
      if (is_new) entry->second = EssentialMatrix(pose, other);
      const Camera& other_camera = reconstruction.Camera(other.CameraId());
      const Eigen::Vector3d y =
          other_camera.ImageToWorld(other.Point2D(correspondence.point2D_idx).XY()).homogeneous();
      ++(SampsonError(entry->second, x, y) <= max_error ? votes.agree : votes.contradict);
    }
  }
  return votes;
}

Votes EpipolarVotes(const SceneMap& map, ImageId image_id) {
  const Image& image = map.reconstruction().Image(image_id);
  BundlePose pose;
  GetPose(image, &pose);
  return EpipolarVotes(map, image_id, map.reconstruction().Camera(image.CameraId()), pose);
}

Votes EpipolarVotes(const SceneMap& map, ImageId id1, ImageId id2) {
  const Reconstruction& reconstruction = map.reconstruction();
  const Image& image1 = reconstruction.Image(id1);
  const Image& image2 = reconstruction.Image(id2);
  const Camera& camera1 = reconstruction.Camera(image1.CameraId());
  const Camera& camera2 = reconstruction.Camera(image2.CameraId());
  const double max_error = NormalizedError(camera1, camera2, limits::kMaxErrorPx);
  BundlePose pose;
  GetPose(image1, &pose);
  const Eigen::Matrix3d E = EssentialMatrix(pose, image2);
  Votes votes;
  for (const FeatureMatch& match : map.MatchesOfPair(id1, id2)) {
    const Eigen::Vector3d x =
        camera1.ImageToWorld(image1.Point2D(match.point2D_idx1).XY()).homogeneous();
    const Eigen::Vector3d y =
        camera2.ImageToWorld(image2.Point2D(match.point2D_idx2).XY()).homogeneous();
    ++(SampsonError(E, x, y) <= max_error ? votes.agree : votes.contradict);
  }
  return votes;
}

unsigned SeedFromIds(uint64_t a, uint64_t b) {
  uint64_t x = a * 0x9E3779B97F4A7C15ull + b;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  return static_cast<unsigned>(x ^ (x >> 31));
}

VisiblePoints FindVisiblePoints(const SceneMap& map, ImageId image_id) {
  const Reconstruction& reconstruction = map.reconstruction();
  const Image& image = reconstruction.Image(image_id);
  VisiblePoints visible;
  std::vector<Point3DId> seen;
  for (Point2DIdx i = 0; i < image.NumPoints2D(); ++i) {
    seen.clear();
    for (const auto& correspondence : map.graph().FindCorrespondences(image_id, i)) {
      const Image& other = reconstruction.Image(correspondence.image_id);
      if (!other.IsRegistered()) continue;
      const Point2D& point2D = other.Point2D(correspondence.point2D_idx);
      if (!point2D.HasPoint3D()) continue;
      const Point3DId id = point2D.Point3DId();
      if (std::find(seen.begin(), seen.end(), id) != seen.end()) continue;
      seen.push_back(id);
      visible.point2D_idxs.push_back(i);
      visible.point3D_ids.push_back(id);
      visible.pixels.push_back(image.Point2D(i).XY());
      visible.xyz.push_back(reconstruction.Point3D(id).XYZ());
    }
  }
  return visible;
}

PoseEstimate EstimatePose(const SceneMap& map, ImageId image_id, const VisiblePoints& visible,
                          const TrialContext& context) {
  const Image& image = map.reconstruction().Image(image_id);
  Camera camera = map.reconstruction().Camera(image.CameraId());
  const CameraState& state = map.camera_state(camera.CameraId());
  const bool estimate_camera = MayEstimateCamera(map, image_id);
  if (estimate_camera) camera.SetParams(state.prior_params);  // not what the photo settled for
  PoseEstimate estimate;
  estimate.pose.image_id = image_id;
  estimate.num_visible = static_cast<int>(visible.size());
  if (estimate.num_visible < limits::kMinPoseInliers) {
    return Refuse(estimate, Refusal::Cause::kTooFewCommonPoints, "too few visible points");
  }
  SetRandomSeed(SeedFromIds(image_id, visible.size()));
  const CameraUse use{estimate_camera && !state.focal_from_exif, estimate_camera};
  const Candidate found = FindPose(map, use, visible, {estimate, camera});
  if (found.cost == HUGE_VAL)
    return Refuse(estimate, Refusal::Cause::kTooFewCommonPoints, "too few inliers");
  estimate = found.estimate;
  camera = found.camera;
  estimate.has_own_camera |= map.HaveItsPhotosOwnCameras(camera.CameraId());
  estimate.camera_params = camera.Params();
  if (estimate.num_inliers < limits::kMinPoseInliers)
    return Refuse(estimate, Refusal::Cause::kTooFewCommonPoints, "too few inliers");
  if (estimate.num_inliers < kMinInlierRatio * estimate.num_visible) {
    return Refuse(estimate, Refusal::Cause::kTooFewCommonPoints,
                  "too small a part of the visible points fits");
  }
  if (!HasPossibleIntrinsics(camera))
    return Refuse(estimate, Refusal::Cause::kCamera, "camera parameters out of range");
  if (!IsDetermined(estimate.sigmas, kSigmasOfAStart)) {
    return Refuse(estimate, Refusal::Cause::kTooFewCommonPoints,
                  "pose badly determined by its inliers");
  }
  const CellVotes votes = CompareWithNeighbours(
      map, image_id, camera, ComposeProjectionMatrix(estimate.pose.R, estimate.pose.t));
  estimate.has_too_many_missing_cells = HasTooManyMissingCells(votes);
  if (estimate.has_too_many_missing_cells && context.matches_similar_place) {
    return Refuse(estimate, Refusal::Cause::kSimilarPlace,
                  "another, visually similar place: " + std::to_string(votes.num_missing) + " of " +
                      std::to_string(votes.num_cells()) + " cells that it should show are missing");
  }
  if (context.needs_min_cells && votes.num_cells() < kMinCells) {
    return Refuse(estimate, Refusal::Cause::kSimilarPlace,
                  "perhaps of another, visually similar place: too few cells to tell");
  }
  estimate.ok = true;
  return estimate;
}

bool FitsElsewhere(const SceneMap& map, ImageId image_id, const VisiblePoints& visible) {
  const Image& image = map.reconstruction().Image(image_id);
  const bool is_alone = MayEstimateCamera(map, image_id);
  const bool may_be_alone = is_alone || MayBeOfSeveralCameras(map.camera_state(image.CameraId()));
  const double observed = image.NumPoints3D();
  if (observed >= (may_be_alone ? kMinObservedAlone : kMinObserved) * visible.size()) return false;
  const PoseEstimate estimate = EstimatePose(map, image_id, visible);
  if (!is_alone && !estimate.has_own_camera && observed >= kMinObserved * visible.size()) {
    return false;
  }
  BundlePose pose;
  GetPose(image, &pose);
  if (!estimate.ok || !IsDetermined(estimate.sigmas) || !Differ(visible, estimate, pose)) {
    return false;
  }
  Camera camera = map.reconstruction().Camera(image.CameraId());
  camera.SetParams(estimate.camera_params);
  const Votes votes = EpipolarVotes(map, image_id, camera, estimate.pose);
  return votes.AgreeingShare() >= kMinEpipolarShare;
}

bool HasBetterPose(const SceneMap& map, ImageId image_id) {
  const VisiblePoints visible = Thinned(FindVisiblePoints(map, image_id));
  if (static_cast<int>(visible.size()) < limits::kMinPoseInliers) return false;
  const Image& image = map.reconstruction().Image(image_id);
  Candidate none;
  none.estimate.pose.image_id = image_id;
  none.camera = map.reconstruction().Camera(image.CameraId());
  SetRandomSeed(SeedFromIds(image_id, visible.size()));
  const Candidate found = BestAtAnyLimit(map, {false, false}, visible, none);
  BundlePose pose;
  GetPose(image, &pose);
  return found.cost < RobustCost(none.camera, visible, pose) &&
         Differ(visible, found.estimate, pose);
}

void RegisterWithPose(const PoseEstimate& estimate, const VisiblePoints& visible, ImageId image_id,
                      SceneMap* map) {
  const Reconstruction& reconstruction = map->reconstruction();
  const Image& image = reconstruction.Image(image_id);
  if (estimate.has_own_camera) map->GiveOwnCamera(image_id);
  map->SetPose(estimate.pose);
  map->SetCamera(image.CameraId(), estimate.camera_params);
  map->Register(image_id);
  for (size_t i = 0; i < visible.size(); ++i) {
    const Point3DId point3D_id = visible.point3D_ids[i];
    if (!estimate.inlier_mask[i] || image.Point2D(visible.point2D_idxs[i]).HasPoint3D() ||
        !reconstruction.ExistsPoint3D(point3D_id)) {
      continue;
    }
    map->ContinueTrack(point3D_id, image_id, visible.point2D_idxs[i]);
  }
}

}  // namespace skein
