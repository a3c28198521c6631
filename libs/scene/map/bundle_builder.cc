#include "map/bundle_builder.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "core/limits.h"
#include "core/statistics.h"
#include "map/bundle_assembly.h"
#include "map/image_pose.h"
#include "map/map_access.h"
#include "map/photos_around.h"
#include "sfm/model_io.h"

namespace skein {
namespace {

constexpr size_t kMinImagesForDistortion = 3;

// In an order by chance, the same each time.
std::vector<Point3DId> Shuffled(std::vector<Point3DId> points) {
  std::mt19937 random(1);
  for (size_t i = points.size(); i > 1; --i) std::swap(points[i - 1], points[random() % i]);
  return points;
}

// Points that two or more of the images see, and without which one of them would have too few.
std::vector<Point3DId> SomePoints(const Reconstruction& model, const std::vector<ImageId>& images) {
  std::unordered_map<ImageId, int> num_observations;
  for (const ImageId id : images) num_observations[id] = 0;
  std::vector<Point3DId> some;
  std::vector<int*> counts;  // of the images that see the point
  for (const Point3DId id : Shuffled(AscendingPoints(model))) {
    counts.clear();
    for (const TrackElement& element : model.Point3D(id).Track().Elements()) {
      const auto found = num_observations.find(element.image_id);
      if (found != num_observations.end()) counts.push_back(&found->second);
    }
    const bool is_wanted = std::any_of(counts.begin(), counts.end(),
                                       [](const int* n) { return *n < kObservationsOfSome; });
    if (counts.size() < 2 || !is_wanted) continue;
    for (int* n : counts) ++*n;
    some.push_back(id);
  }
  std::sort(some.begin(), some.end());
  return some;
}

// m^2 / (2 ln 2) * n / (n - p), in square pixels. m: median error, which mismatches hardly change;
// of Gaussian noise of two coordinates m^2 is 2 ln 2 times the variance. n: coordinates of the
// observations, p: those of the points that are refined.
double NoiseVariance(const Bundle& bundle) {
  const double num_coordinates = 2.0 * static_cast<double>(bundle.observations.size());
  const double num_fitted = 3.0 * std::count_if(bundle.points.begin(), bundle.points.end(),
                                                [](const BundlePoint& p) { return !p.constant; });
  if (num_coordinates <= num_fitted) return 1;
  const double median = std::max(UpperMedian(ReprojectionErrors(bundle)), 0.01);
  return median * median / (2 * std::log(2)) * num_coordinates / (num_coordinates - num_fitted);
}

}  // namespace

BundleCamera MakeBundleCamera(const SceneMap& map, CameraId id, bool refine_focal,
                              bool refine_distortion) {
  const Camera& camera = map.reconstruction().Camera(id);
  const CameraState& state = map.camera_state(id);
  BundleCamera result;
  result.camera_id = id;
  result.model_id = camera.ModelId();
  result.params = camera.Params();
  result.prior = state.prior_params;
  result.square_pixels = camera.HasTwoEqualFocalLengths() &&
                         CameraModelFocalLengthIdxs(state.given_model_id).size() == 1;
  result.prior_sigma.assign(result.params.size(), 0.0);
  for (const size_t i : camera.FocalLengthIdxs()) {
    result.prior_sigma[i] = result.prior[i] * (state.focal_from_exif ? limits::kFocalSigmaExif
                                                                     : limits::kFocalSigmaGuess);
    const bool follows = result.square_pixels && i == 1;
    if (refine_focal && !state.fixed && !follows) result.refined.push_back(static_cast<int>(i));
  }
  for (const size_t i : camera.ExtraParamsIdxs()) {
    result.prior_sigma[i] = limits::kDistortionSigma;
    if (refine_distortion && !state.fixed) result.refined.push_back(static_cast<int>(i));
  }
  return result;
}

void ScalePriors(Bundle* bundle) {
  if (std::all_of(bundle->cameras.begin(), bundle->cameras.end(),
                  [](const BundleCamera& camera) { return camera.refined.empty(); }))
    return;
  const double variance = std::min(NoiseVariance(*bundle), 1.0);
  std::vector<double> num_images(bundle->cameras.size(), 0.0);
  std::vector<double> num_observations(bundle->cameras.size(), 0.0);
  for (const BundlePose& pose : bundle->poses) num_images[pose.camera] += 1;
  for (const BundleObservation& observation : bundle->observations) {
    num_observations[bundle->poses[observation.pose].camera] += 1;
  }
  for (size_t i = 0; i < bundle->cameras.size(); ++i) {
    const double surplus = num_observations[i] / (kIndependentObservations * num_images[i]);
    const double factor = std::sqrt(variance * std::max(1.0, surplus));
    for (double& sigma : bundle->cameras[i].prior_sigma) sigma /= factor;
  }
}

Bundle BuildBundle(const SceneMap& map, const BundleRequest& request) {
  const bool refine_distortion =
      request.refine_cameras && map.reconstruction().NumRegImages() >= kMinImagesForDistortion;
  BundleAssembly assembly(map.reconstruction(), [&](CameraId id) {
    return MakeBundleCamera(map, id, request.refine_cameras, refine_distortion);
  });
  for (size_t i = 0; i < request.free.size(); ++i) {
    const bool is_plain = request.stiffness.empty();
    assembly.AddPose(request.free[i], false, is_plain ? PoseStiffness() : request.stiffness[i]);
  }
  for (const ImageId id : request.held) assembly.AddPose(id, true);
  for (const Point3DId id : request.points) assembly.AddPoint(id, request.hold_open_points);
  for (const ImageId id : ObserversOf(map, request.complete_points)) assembly.AddPose(id, true);
  for (const Point3DId id : request.complete_points) assembly.AddPoint(id);
  Bundle bundle = assembly.Take();
  ScalePriors(&bundle);
  return bundle;
}

Bundle BuildGlobalBundle(const SceneMap& map, bool refine_cameras) {
  BundleRequest request;
  request.free = map.reconstruction().RegImageIds();
  request.points = AscendingPoints(map.reconstruction());
  request.refine_cameras = refine_cameras;
  return BuildBundle(map, request);
}

std::vector<ImageId> ImagesOfSome(const SceneMap& map) {
  const Reconstruction& model = map.reconstruction();
  if (model.NumRegImages() <= kImagesOfSome) return model.RegImageIds();
  std::vector<ImageId> first_of_camera;
  std::unordered_set<CameraId> seen;
  for (const ImageId id : model.RegImageIds()) {
    if (seen.insert(model.Image(id).CameraId()).second) first_of_camera.push_back(id);
  }
  return RegisteredAround(map, std::move(first_of_camera), kImagesOfSome);
}

Bundle BuildBundleOfSome(const SceneMap& map, bool refine_cameras) {
  BundleRequest request;
  request.free = ImagesOfSome(map);
  request.points = SomePoints(map.reconstruction(), request.free);
  request.refine_cameras = refine_cameras;
  return BuildBundle(map, request);
}

void ApplyBundle(const Bundle& bundle, SceneMap* map) {
  ApplyBundle(bundle, &MapAccess::Model(map));
}

}  // namespace skein
