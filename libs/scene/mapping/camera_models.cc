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
#include "mapping/model_check.h"
#include "sfm/camera_fit.h"

namespace skein {
namespace {

constexpr int kMinPhotosOfModel = 3;
// A model with which positions are so many times less certain: the photos cannot tell its
// parameters from poses. Models that brought maps nearer to the truth left 0.1 to 1.05 of the
// expected error, one that bent a flight in parallel lines 3.6 to 4.3
// (docs/experiments/camera_models.md).
constexpr double kMaxLooser = 1.5;
constexpr double kErrorCapPx = 100;  // what an observation may add, also one behind the camera

std::vector<Camera> OpenCameras(const SceneMap& map) {
  std::vector<Camera> open;
  for (const auto& [id, state] : map.camera_states()) {
    if (state.known || state.num_registered < kMinPhotosOfModel) continue;
    if (state.num_registered == state.num_at_choice) continue;
    open.push_back(map.reconstruction().Camera(id));
  }
  return open;
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
    const bool is_adjusted = !chosen.empty() && Adjust(chosen);
    SetCameras(before_, &map_);
    for (const Camera& camera : before_) map_.NoteModelChosen(camera.CameraId());
    if (!is_adjusted) return false;
    SetCameras(chosen, &map_);
    ApplyBundle(bundle_, &map_);
    return true;
  }

 private:
  // Cameras that get another model.
  std::vector<Camera> Choose() {
    if (!Adjust(GivenModels())) return {};
    best_ = FitsOf(bundle_, map_);
    start_ = std::move(bundle_);
    Try(kOpenCv, before_);
    Try(kOpenCvFisheye, Richer());
    return Changed();
  }

  // With these cameras, from the poses and points that were found to be best, or the map's.
  bool Adjust(const std::vector<Camera>& cameras) {
    SetCameras(before_, &map_);
    SetCameras(cameras, &map_);
    bundle_ = BuildGlobalBundle(map_, true);
    if (start_) {
      bundle_.poses = start_->poses;
      bundle_.points = start_->points;
    }
    return SolveBundle(options_, &bundle_).usable;
  }

  // Back from what an earlier choice, of fewer photos, has found.
  std::vector<Camera> GivenModels() const {
    std::vector<Camera> given;
    for (const Camera& camera : before_) {
      given.push_back(FitCameraModel(camera, map_.camera_state(camera.CameraId()).given_model_id));
    }
    return given;
  }

  void Try(int model_id, std::vector<Camera> cameras) {
    for (Camera& camera : cameras) {
      camera = FitCameraModel(best_.at(camera.CameraId()).camera, model_id);
    }
    if (cameras.empty() || !Adjust(cameras)) return;
    const std::map<CameraId, Fit> fits = FitsOf(bundle_, map_);
    cameras.erase(std::remove_if(cameras.begin(), cameras.end(),
                                 [&](const Camera& c) { return !IsBetter(fits.at(c.CameraId())); }),
                  cameras.end());
    if (cameras.empty() || IsTooLoose()) return;
    for (const Camera& camera : cameras) best_[camera.CameraId()] = fits.at(camera.CameraId());
    start_ = std::move(bundle_);
  }

  bool IsBetter(const Fit& fit) const {
    const Fit& best = best_.at(fit.camera.CameraId());
    LogInfo("camera {}: {} leaves {:.4f} of the errors of {} photos with {}", fit.camera.CameraId(),
            fit.camera.ModelName(), fit.cost / best.cost, best.num_images, best.camera.ModelName());
    return fit.Criterion() < best.Criterion();
  }

  bool IsTooLoose() {
    if (sigma_before_ == 0) sigma_before_ = CheckShape(*start_).position_sigma;
    const double sigma = CheckShape(bundle_).position_sigma;
    LogInfo("position sigma {:.4f} % of the extent, {:.4f} before", 100 * sigma,
            100 * sigma_before_);
    const bool is_known = sigma > 0 && sigma < 1;
    return !is_known || sigma > kMaxLooser * sigma_before_;
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
      if (best.ModelId() != camera.ModelId() && HasPossibleIntrinsics(best)) {
        changed.push_back(best);
      }
    }
    return changed;
  }

  BundleOptions options_;
  SceneMap& map_;
  const std::vector<Camera> before_;
  std::map<CameraId, Fit> best_;
  double sigma_before_ = 0;
  std::optional<Bundle> start_;  // adjusted with the best models
  Bundle bundle_;                // as last adjusted
};

}  // namespace

bool ChooseCameraModels(const BundleOptions& options, SceneMap* map) {
  return Chooser(options, map).Run();
}

}  // namespace skein
