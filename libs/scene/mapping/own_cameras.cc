#include "mapping/own_cameras.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <vector>

#include "core/log.h"
#include "map/bundle_builder.h"
#include "mapping/two_groups.h"
#include "sfm/camera.h"
#include "sfm/camera_fit.h"

namespace skein {
namespace {

constexpr double kMaxRemaining = 0.5;
// The same limit if the own focal lengths are of two groups. One camera's photos leave 0.69 or
// more; two maps that were merged, each with an error of its own, left 0.97 and 0.99 with two
// groups.
constexpr double kMaxRemainingOfGroups = 0.75;
constexpr size_t kMinPhotos = 3;

std::set<CameraId> SharedCameras(const SceneMap& map) {
  std::set<CameraId> shared;
  if (map.reconstruction().NumRegImages() < kMinPhotos) return shared;
  for (const auto& [id, state] : map.camera_states()) {
    if (!state.fixed && state.num_registered >= 2) shared.insert(id);
  }
  return shared;
}

// The cameras of the poses that share one of these become cameras of their own, which start from
// its parameters and have its prior.
void Split(const std::set<CameraId>& shared, Bundle* bundle) {
  for (BundlePose& pose : bundle->poses) {
    BundleCamera camera = bundle->cameras[pose.camera];
    if (shared.count(camera.camera_id) == 0) continue;
    camera.camera_id = SceneMap::OwnCamera(pose.image_id);
    pose.camera = static_cast<int>(bundle->cameras.size());
    bundle->cameras.push_back(std::move(camera));
  }
}

// A bundle of the map, with cameras of their own for the poses of `shared`: in the model that these
// came with, as one photo tells no other.
Bundle BuildSplitBundle(const std::set<CameraId>& shared, Bundle (*build)(const SceneMap&, bool),
                        SceneMap* map) {
  std::vector<Camera> cameras;
  for (const CameraId id : shared) cameras.push_back(map->reconstruction().Camera(id));
  for (const Camera& camera : cameras) {
    map->SetCamera(FitCameraModel(camera, map->camera_state(camera.CameraId()).given_model_id));
  }
  Bundle bundle = build(*map, true);
  for (const Camera& camera : cameras) map->SetCamera(camera);
  Split(shared, &bundle);
  return bundle;
}

// By the camera that the photos came to the bundle with.
std::map<CameraId, double> SumsOfSquares(const Bundle& bundle,
                                         const std::vector<CameraId>& camera_of_pose) {
  std::map<CameraId, double> sums;
  const std::vector<double> errors = ReprojectionErrors(bundle);
  for (size_t i = 0; i < errors.size(); ++i) {
    sums[camera_of_pose[bundle.observations[i].pose]] += errors[i] * errors[i];
  }
  return sums;
}

// ln f of the photos' own cameras, by the camera that the photos came to the bundle with.
std::map<CameraId, std::vector<double>> LogFocals(const Bundle& bundle,
                                                  const std::vector<CameraId>& camera_of_pose) {
  std::map<CameraId, std::vector<double>> focals;
  for (size_t i = 0; i < bundle.poses.size(); ++i) {
    const BundleCamera& camera = bundle.cameras[bundle.poses[i].camera];
    const size_t focal = CameraModelFocalLengthIdxs(camera.model_id)[0];
    focals[camera_of_pose[i]].push_back(std::log(camera.params[focal]));
  }
  return focals;
}

// The cameras of `shared` whose photos need intrinsics of their own.
std::set<CameraId> CamerasToSplit(const BundleOptions& options, const std::set<CameraId>& shared,
                                  SceneMap* map) {
  Bundle bundle = BuildBundleOfSome(*map, true);
  std::vector<CameraId> camera_of_pose;
  for (const BundlePose& pose : bundle.poses) {
    camera_of_pose.push_back(bundle.cameras[pose.camera].camera_id);
  }
  const auto before = SumsOfSquares(bundle, camera_of_pose);
  bundle = BuildSplitBundle(shared, BuildBundleOfSome, map);
  if (!SolveBundle(options, &bundle).usable) return {};
  const auto after = SumsOfSquares(bundle, camera_of_pose);
  const auto log_focals = LogFocals(bundle, camera_of_pose);
  std::set<CameraId> split;
  for (const CameraId id : shared) {
    const double remaining = before.count(id) > 0 ? after.at(id) / before.at(id) : 1;
    if (!std::isfinite(remaining)) return {};  // the model is too far from the lens
    const bool are_groups = remaining < kMaxRemainingOfGroups && AreTwoGroups(log_focals.at(id));
    LogInfo("camera {}: own intrinsics leave {:.3f} of the squared errors of {} photos{}", id,
            remaining, std::count(camera_of_pose.begin(), camera_of_pose.end(), id),
            are_groups ? ", focal lengths of two groups" : "");
    if (remaining < kMaxRemaining || are_groups) split.insert(id);
  }
  return split;
}

// Photos with cameras of their own, where others have the camera that these came with.
std::vector<ImageId> PhotosApart(const SceneMap& map) {
  std::vector<ImageId> apart;
  for (const ImageId id : map.reconstruction().RegImageIds()) {
    const CameraId given = map.GivenCamera(id);
    const bool is_apart = given != map.reconstruction().Image(id).CameraId();
    if (is_apart && map.camera_state(given).num_registered > 0) apart.push_back(id);
  }
  return apart;
}

// Refines a photo's pose, its own intrinsics and its points. The points' other photos are constant.
Bundle BuildPhotoBundle(const SceneMap& map, ImageId id) {
  BundleRequest request;
  request.free = {id};
  request.complete_points = PointsSeenBy(map, {id});
  request.refine_cameras = true;
  Bundle bundle = BuildBundle(map, request);
  for (size_t i = 0; i < bundle.cameras.size(); ++i) {
    if (static_cast<int>(i) != bundle.poses[0].camera) bundle.cameras[i].refined.clear();
  }
  return bundle;
}

// The sum over the first pose's observations, after the bundle is adjusted; infinite if that fails.
double AdjustedSumOfSquares(const BundleOptions& options, Bundle* bundle) {
  if (!SolveBundle(options, bundle).usable) return HUGE_VAL;
  const std::vector<double> errors = ReprojectionErrors(*bundle);
  double sum = 0;
  for (size_t i = 0; i < errors.size(); ++i) {
    if (bundle->observations[i].pose == 0) sum += errors[i] * errors[i];
  }
  return sum;
}

// S(own) / S(given). S: the photo's sum of squared errors after an adjustment with its own
// intrinsics, or with the camera that it came with.
double RemainingOfPhoto(const BundleOptions& options, const SceneMap& map, ImageId id) {
  Bundle own = BuildPhotoBundle(map, id);
  Bundle shared = own;
  shared.poses[0].camera = static_cast<int>(shared.cameras.size());
  shared.cameras.push_back(MakeBundleCamera(map, map.GivenCamera(id), false, false));
  return AdjustedSumOfSquares(options, &own) / AdjustedSumOfSquares(options, &shared);
}

}  // namespace

bool ShareCamerasAgain(BundleOptions options, SceneMap* map) {
  options.factor = nullptr;  // of other unknowns
  bool any = false;
  for (const ImageId id : PhotosApart(*map)) {
    const double remaining = RemainingOfPhoto(options, *map, id);
    LogInfo("photo {}: own intrinsics leave {:.3f} of its squared errors", id, remaining);
    if (!std::isfinite(remaining) || remaining < kMaxRemaining) continue;
    map->RemoveOwnCamera(id);
    any = true;
  }
  if (!any) return false;
  Bundle bundle = BuildGlobalBundle(*map, true);
  if (SolveBundle(options, &bundle).usable) ApplyBundle(bundle, map);
  return true;
}

bool GiveOwnCameras(BundleOptions options, SceneMap* map) {
  const std::set<CameraId> shared = SharedCameras(*map);
  if (shared.empty()) return false;
  options.factor = nullptr;  // of other unknowns
  const std::set<CameraId> split = CamerasToSplit(options, shared, map);
  if (split.empty()) return false;
  Bundle bundle = BuildSplitBundle(split, BuildGlobalBundle, map);
  if (!SolveBundle(options, &bundle).usable) return false;
  for (const BundlePose& pose : bundle.poses) {
    const CameraId shared_camera = map->reconstruction().Image(pose.image_id).CameraId();
    if (split.count(shared_camera) > 0) map->GiveOwnCamera(pose.image_id);
  }
  // No pose has a camera that was split.
  for (BundleCamera& camera : bundle.cameras) {
    if (split.count(camera.camera_id) > 0) camera.refined.clear();
  }
  ApplyBundle(bundle, map);
  return true;
}

}  // namespace skein
