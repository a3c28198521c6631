#include "mapping/camera_models.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/log.h"
#include "map/bundle_builder.h"
#include "map/image_pose.h"
#include "sfm/camera_fit.h"

namespace skein {
namespace {

constexpr int kMinPhotosOfModel = 3;
// Photos are squeezed if a free focal ratio leaves at most this part of the errors with square
// pixels. Photos stretched by a third left 0.2, a rolling shutter 0.99, and the shape of the ground
// under parallel lines of flight 0.98.
constexpr double kMaxLeftIfSqueezed = 0.5;
constexpr double kErrorCapPx = 100;  // what an observation may add, also one behind the camera

// Cameras whose model is in question, and enough photos of which are compared.
std::vector<Camera> OpenCameras(const SceneMap& map) {
  std::vector<CameraId> open;
  for (const auto& [id, state] : map.camera_states()) {
    if (state.known || state.num_registered < kMinPhotosOfModel) continue;
    if (state.num_registered != state.num_at_choice) open.push_back(id);
  }
  if (open.empty()) return {};
  std::map<CameraId, int> num_photos;
  for (const ImageId id : ImagesOfSome(map)) {
    ++num_photos[map.reconstruction().Image(id).CameraId()];
  }
  std::vector<Camera> cameras;
  for (const CameraId id : open) {
    if (num_photos[id] >= kMinPhotosOfModel) cameras.push_back(map.reconstruction().Camera(id));
  }
  return cameras;
}

void FreeFocalRatios(Bundle* bundle) {
  for (BundleCamera& camera : bundle->cameras) {
    if (!std::exchange(camera.square_pixels, false) || camera.refined.empty()) continue;
    camera.refined.insert(camera.refined.begin() + 1, 1);
  }
}

// A camera's part of an adjusted map.
struct Fit {
  Camera camera;
  double cost = 0;  // sum of soft L1 errors; infinite: impossible intrinsics
  int num_observations = 0;
  int num_images = 0;
  int num_refined = 0;

  double Criterion() const {
    const double n = std::min<double>(num_observations, kIndependentObservations * num_images);
    return n * std::log(cost) + num_refined * std::log(n);
  }
};

std::map<CameraId, Fit> FitsOf(const Bundle& bundle, const SceneMap& map) {
  std::map<CameraId, Fit> fits;
  for (const BundleCamera& camera : bundle.cameras) {
    Fit& fit = fits[camera.camera_id];
    fit.camera = map.reconstruction().Camera(camera.camera_id);
    fit.camera.SetParams(camera.params);
    fit.num_refined = static_cast<int>(camera.refined.size());
    if (!HasPossibleIntrinsics(fit.camera)) fit.cost = std::numeric_limits<double>::infinity();
  }
  const std::vector<double> errors = ReprojectionErrors(bundle);
  const auto fit_of = [&](int pose) -> Fit& {
    return fits[bundle.cameras[bundle.poses[pose].camera].camera_id];
  };
  for (size_t i = 0; i < bundle.poses.size(); ++i) ++fit_of(static_cast<int>(i)).num_images;
  for (size_t i = 0; i < errors.size(); ++i) {
    Fit& fit = fit_of(bundle.observations[i].pose);
    const double error = std::min(errors[i], kErrorCapPx);
    fit.cost += 2 * (std::sqrt(1 + error * error) - 1);
    ++fit.num_observations;
  }
  return fits;
}

void SetCameras(const std::vector<Camera>& cameras, SceneMap* map) {
  for (const Camera& camera : cameras) map->SetCamera(camera);
}

class Chooser {
 public:
  Chooser(const BundleOptions& options, SceneMap* map)
      : options_(options), map_(*map), before_(OpenCameras(*map)) {
    options_.factor = nullptr;  // of other unknowns
  }

  bool Run() {
    if (before_.empty()) return false;
    const std::vector<Camera> chosen = Choose();
    const bool is_adjusted = !chosen.empty() && AdjustWhole(chosen);
    SetCameras(before_, &map_);
    if (options_.stop && options_.stop()) return false;  // of fits that are not complete
    for (const Camera& camera : before_) map_.NoteModelChosen(camera.CameraId());
    if (!is_adjusted) return false;
    SetCameras(chosen, &map_);
    ApplyBundle(bundle_, &map_);
    return true;
  }

 private:
  // Cameras that get another model.
  std::vector<Camera> Choose() {
    if (!AdjustPart(GivenModels())) return {};
    best_ = FitsOf(bundle_, map_);
    start_ = std::move(bundle_);
    Try(kOpenCv, before_, false);
    Try(kOpenCv, before_, true);
    Try(kOpenCvFisheye, Richer(), false);
    return Changed();
  }

  bool AdjustWhole(const std::vector<Camera>& cameras) {
    Set(cameras);
    bundle_ = BuildGlobalBundle(map_, true);
    return SolveBundle(options_, &bundle_).usable;
  }

  // A part of the map with these cameras, from where poses and points were best, or the map has
  // them.
  bool AdjustPart(const std::vector<Camera>& cameras, bool squeezed = false) {
    Set(cameras);
    bundle_ = BuildBundleOfSome(map_, true);
    if (squeezed) FreeFocalRatios(&bundle_);
    if (start_) {
      bundle_.poses = start_->poses;
      bundle_.points = start_->points;
    }
    return SolveBundle(options_, &bundle_).usable;
  }

  // The others are as before.
  void Set(const std::vector<Camera>& cameras) {
    SetCameras(before_, &map_);
    SetCameras(cameras, &map_);
  }

  // Back from what an earlier choice, of fewer photos, has found.
  std::vector<Camera> GivenModels() const {
    std::vector<Camera> given;
    for (const Camera& camera : before_) {
      given.push_back(FitCameraModel(camera, map_.camera_state(camera.CameraId()).given_model_id));
    }
    return given;
  }

  void Try(int model_id, std::vector<Camera> cameras, bool squeezed) {
    for (Camera& camera : cameras) {
      camera = FitCameraModel(best_.at(camera.CameraId()).camera, model_id);
    }
    if (cameras.empty() || !AdjustPart(cameras, squeezed)) return;
    const std::map<CameraId, Fit> fits = FitsOf(bundle_, map_);
    const auto is_worse = [&](const Camera& c) {
      const Fit& fit = fits.at(c.CameraId());
      return !IsBetter(fit, squeezed ? kMaxLeftIfSqueezed : 1);
    };
    cameras.erase(std::remove_if(cameras.begin(), cameras.end(), is_worse), cameras.end());
    if (cameras.empty()) return;
    for (const Camera& camera : cameras) best_[camera.CameraId()] = fits.at(camera.CameraId());
    start_ = std::move(bundle_);
  }

  bool IsBetter(const Fit& fit, double max_left) const {
    const Fit& best = best_.at(fit.camera.CameraId());
    LogInfo("camera {}: {} (focal ratio {:.4f}) leaves {:.4f} of the errors of {} photos with {}",
            fit.camera.CameraId(), fit.camera.ModelName(),
            fit.camera.FocalLengthX() / fit.camera.FocalLengthY(), fit.cost / best.cost,
            best.num_images, best.camera.ModelName());
    return fit.Criterion() < best.Criterion() && fit.cost <= max_left * best.cost;
  }

  // Cameras that the model they came with is not enough for.
  std::vector<Camera> Richer() const {
    std::vector<Camera> richer;
    for (const Camera& camera : before_) {
      if (best_.at(camera.CameraId()).camera.ModelId() == kOpenCv) richer.push_back(camera);
    }
    return richer;
  }

  std::vector<Camera> Changed() const {
    std::vector<Camera> changed;
    for (const Camera& camera : before_) {
      const Camera& best = best_.at(camera.CameraId()).camera;
      const bool is_other = best.ModelId() != camera.ModelId() ||
                            best.HasTwoEqualFocalLengths() != camera.HasTwoEqualFocalLengths();
      if (is_other && HasPossibleIntrinsics(best)) changed.push_back(best);
    }
    return changed;
  }

  BundleOptions options_;
  SceneMap& map_;
  const std::vector<Camera> before_;
  std::map<CameraId, Fit> best_;
  std::optional<Bundle> start_;  // adjusted with the best models
  Bundle bundle_;                // as last adjusted
};

}  // namespace

bool ChooseCameraModels(const BundleOptions& options, SceneMap* map) {
  return Chooser(options, map).Run();
}

}  // namespace skein
