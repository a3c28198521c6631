#include "mapping/own_cameras.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "core/log.h"
#include "core/statistics.h"
#include "map/bundle_builder.h"
#include "sfm/camera.h"
#include "sfm/camera_fit.h"

namespace skein {
namespace {

// The largest (1 - r) s of one camera. r: the part of the squared errors that own intrinsics leave,
// s: the standard deviation of ln f. One camera has 0.015 or less, in maps of 3 or 4 photos 0.035;
// zoomed photos have 0.027 or more (docs/experiments/own_cameras.md).
constexpr double kMaxExplainedSpread = 0.02;
constexpr double kMaxDeviation = 0.1;  // of a photo's ln f from that of the camera it came with
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

double LogFocal(int model_id, const std::vector<double>& params) {
  return std::log(params[CameraModelFocalLengthIdxs(model_id)[0]]);
}

// ln f of the photos' own cameras, by the camera that the photos came to the bundle with.
std::map<CameraId, std::vector<double>> LogFocals(const Bundle& bundle,
                                                  const std::vector<CameraId>& camera_of_pose) {
  std::map<CameraId, std::vector<double>> focals;
  for (size_t i = 0; i < bundle.poses.size(); ++i) {
    const BundleCamera& camera = bundle.cameras[bundle.poses[i].camera];
    focals[camera_of_pose[i]].push_back(LogFocal(camera.model_id, camera.params));
  }
  return focals;
}

double StandardDeviation(const std::vector<double>& values) {
  const double center = mean(values);
  double sum = 0;
  for (const double value : values) sum += (value - center) * (value - center);
  return std::sqrt(sum / static_cast<double>(values.size()));
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
  std::set<CameraId> split;
  for (const auto& [id, log_focals] : LogFocals(bundle, camera_of_pose)) {
    if (shared.count(id) == 0) continue;
    const double remaining = before.count(id) > 0 ? after.at(id) / before.at(id) : 1;
    if (!std::isfinite(remaining)) return {};  // the model is too far from the lens
    const double spread = StandardDeviation(log_focals);
    LogInfo(
        "camera {}: own intrinsics leave {:.3f} of the squared errors of {} photos, sd(ln f) "
        "{:.3f}",
        id, remaining, log_focals.size(), spread);
    if ((1 - remaining) * spread > kMaxExplainedSpread) split.insert(id);
  }
  return split;
}

// Registered photos with cameras of their own, by the camera that they came with.
std::map<CameraId, std::vector<ImageId>> PhotosApart(const SceneMap& map) {
  std::map<CameraId, std::vector<ImageId>> apart;
  for (const ImageId id : map.reconstruction().RegImageIds()) {
    const CameraId given = map.GivenCamera(id);
    if (given != map.reconstruction().Image(id).CameraId()) apart[given].push_back(id);
  }
  return apart;
}

double LogFocal(const SceneMap& map, CameraId id) {
  const Camera& camera = map.reconstruction().Camera(id);
  return LogFocal(camera.ModelId(), camera.Params());
}

// If the own focal lengths of all of a camera's registered photos are alike, the camera gets the
// intrinsics of the photo in the middle, and the photos that are not registered have it again.
bool ReviveCameraIfAlike(CameraId given, const std::vector<ImageId>& photos, SceneMap* map) {
  std::vector<std::pair<double, ImageId>> by_focal;
  for (const ImageId id : photos) {
    by_focal.emplace_back(LogFocal(*map, SceneMap::OwnCamera(id)), id);
    if (!std::isfinite(by_focal.back().first)) return false;  // a NaN has no place in an order
  }
  std::sort(by_focal.begin(), by_focal.end());
  const auto [log_focal, middle] = by_focal[by_focal.size() / 2];
  const double below = log_focal - by_focal.front().first;
  const double above = by_focal.back().first - log_focal;
  if (std::max(below, above) > kMaxDeviation) return false;
  Camera camera = map->reconstruction().Camera(SceneMap::OwnCamera(middle));
  camera.SetCameraId(given);
  map->SetCamera(camera);
  for (const ImageId id : map->photos()) {
    if (!map->IsRegistered(id) && map->GivenCamera(id) == given) map->RemoveOwnCamera(id);
  }
  return true;
}

}  // namespace

bool ShareCamerasAgain(BundleOptions options, SceneMap* map) {
  options.factor = nullptr;  // of other unknowns
  bool any = false;
  for (const auto& [given, photos] : PhotosApart(*map)) {
    const bool is_used = map->camera_state(given).num_registered > 0;
    if (!is_used && !ReviveCameraIfAlike(given, photos, map)) continue;
    const double shared = LogFocal(*map, given);
    for (const ImageId id : photos) {
      const double deviation = LogFocal(*map, SceneMap::OwnCamera(id)) - shared;
      LogInfo("photo {}: ln f deviates by {:.3f} from that of its camera", id, deviation);
      if (!(std::abs(deviation) <= kMaxDeviation)) continue;
      map->RemoveOwnCamera(id);
      any = true;
    }
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
