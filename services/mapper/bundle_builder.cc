#include "mapper/bundle_builder.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace skein {
namespace {

constexpr double kFocalSigmaExif = 0.1;
constexpr double kFocalSigmaGuess = 0.3;
constexpr double kDistortionSigma = 0.1;
constexpr size_t kMinImagesForDistortion = 3;
// Errors of an image's observations (localisation, lens, mistaken matches) are shared by
// neighbours: more of them weigh against a camera's prior as this many.
constexpr double kIndependentObservations = 100;

class Builder {
 public:
  Builder(const SceneMap& map, const BundleRequest& request) : map_(map), request_(request) {}

  Bundle Build() {
    for (size_t i = 0; i < request_.free.size(); ++i) {
      AddPose(request_.free[i], false, request_.weights.empty() ? 1.0 : request_.weights[i]);
    }
    for (const ImageId id : request_.held) AddPose(id, true, 1.0);
    for (const Point3DId id : request_.points) AddPoint(id);
    ScalePriors(&bundle_);
    return std::move(bundle_);
  }

 private:
  void AddPose(ImageId id, bool constant, double weight) {
    if (pose_index_.count(id) > 0 || !map_.IsRegistered(id)) return;
    const colmap::Image& image = map_.reconstruction().Image(id);
    pose_index_[id] = static_cast<int>(bundle_.poses.size());
    BundlePose pose;
    GetPose(image, &pose);
    pose.camera = CameraIndex(image.CameraId());
    pose.constant = constant;
    pose.weight = weight;
    bundle_.poses.push_back(pose);
  }

  int CameraIndex(CameraId id) {
    const auto [it, is_new] = camera_index_.emplace(id, bundle_.cameras.size());
    if (is_new) {
      const bool refine_distortion =
          map_.reconstruction().NumRegImages() >= kMinImagesForDistortion;
      bundle_.cameras.push_back(MakeBundleCamera(map_, id, request_.refine_cameras,
                                                 request_.refine_cameras && refine_distortion));
    }
    return it->second;
  }

  void AddPoint(Point3DId id) {
    const colmap::Point3D& point3D = map_.reconstruction().Point3D(id);
    BundlePoint point;
    point.point3D_id = id;
    point.xyz = point3D.XYZ();
    point.first = static_cast<int>(bundle_.observations.size());
    for (const colmap::TrackElement& element : point3D.Track().Elements()) {
      const auto it = pose_index_.find(element.image_id);
      if (it == pose_index_.end()) continue;
      const colmap::Image& image = map_.reconstruction().Image(element.image_id);
      bundle_.observations.push_back(
          {it->second, element.point2D_idx, image.Point2D(element.point2D_idx).XY()});
    }
    point.count = static_cast<int>(bundle_.observations.size()) - point.first;
    point.constant =
        request_.hold_open_points && point.count < static_cast<int>(point3D.Track().Length());
    if (point.count < 2 && !point.constant) {
      bundle_.observations.resize(point.first);
    } else {
      bundle_.points.push_back(point);
    }
  }

  const SceneMap& map_;
  const BundleRequest& request_;
  Bundle bundle_;
  std::unordered_map<ImageId, int> pose_index_;
  std::unordered_map<CameraId, int> camera_index_;
};

}  // namespace

BundleCamera MakeBundleCamera(const SceneMap& map, CameraId id, bool refine_focal,
                              bool refine_distortion) {
  const colmap::Camera& camera = map.reconstruction().Camera(id);
  const CameraState& state = map.camera_state(id);
  BundleCamera result;
  result.camera_id = id;
  result.model_id = camera.ModelId();
  result.params = camera.Params();
  result.prior = state.prior_params;
  result.prior_sigma.assign(result.params.size(), 0.0);
  for (const size_t i : camera.FocalLengthIdxs()) {
    result.prior_sigma[i] =
        result.prior[i] * (state.focal_from_exif ? kFocalSigmaExif : kFocalSigmaGuess);
    if (refine_focal) result.refined.push_back(static_cast<int>(i));
  }
  for (const size_t i : camera.ExtraParamsIdxs()) {
    result.prior_sigma[i] = kDistortionSigma;
    if (refine_distortion) result.refined.push_back(static_cast<int>(i));
  }
  return result;
}

void ScalePriors(Bundle* bundle) {
  std::vector<double> num_images(bundle->cameras.size(), 0.0);
  std::vector<double> num_observations(bundle->cameras.size(), 0.0);
  for (const BundlePose& pose : bundle->poses) num_images[pose.camera] += 1;
  for (const BundleObservation& observation : bundle->observations) {
    num_observations[bundle->poses[observation.pose].camera] += 1;
  }
  for (size_t i = 0; i < bundle->cameras.size(); ++i) {
    const double surplus = num_observations[i] / (kIndependentObservations * num_images[i]);
    for (double& sigma : bundle->cameras[i].prior_sigma) sigma /= std::sqrt(std::max(1.0, surplus));
  }
}

Bundle BuildBundle(const SceneMap& map, const BundleRequest& request) {
  return Builder(map, request).Build();
}

Bundle BuildGlobalBundle(const SceneMap& map, bool refine_cameras) {
  BundleRequest request;
  request.free = map.reconstruction().RegImageIds();
  for (const auto& [id, point] : map.reconstruction().Points3D()) request.points.push_back(id);
  std::sort(request.points.begin(), request.points.end());
  request.refine_cameras = refine_cameras;
  return BuildBundle(map, request);
}

void ApplyBundle(const Bundle& bundle, SceneMap* map) {
  ApplyBundle(bundle, &map->reconstruction());
}

}  // namespace skein
