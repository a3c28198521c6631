#include "testing/synthetic_submaps.h"

#include <map>
#include <utility>

#include "merging/seam_bundle.h"

namespace skein {
namespace {

SyntheticOptions WithSeed(SyntheticOptions options, unsigned seed) {
  options.seed = seed;
  return options;
}

}  // namespace

SyntheticOptions WallOptions(SyntheticOptions::Shape shape) {
  SyntheticOptions options;
  options.shape = shape;
  options.num_photos = 24;
  options.num_points = 3000;
  options.camera.width_px = 1600;
  options.camera.height_px = 1200;
  options.camera.focal_px = 1300;
  options.camera.distortion = -0.03;
  options.noise_px = 0.5;
  options.detection_rate = 0.7;
  options.num_clutter = 300;
  return options;
}

SyntheticWorld::SyntheticWorld(SyntheticOptions options, unsigned seed)
    : options_(WithSeed(std::move(options), seed)), scene_(MakeScene(options_)) {}

CameraPose SyntheticWorld::Pose(int image_id) const {
  CameraPose pose;
  pose.rotation = Eigen::Quaterniond(scene_.rotations.at(image_id - 1));
  pose.translation = scene_.translations.at(image_id - 1);
  return pose;
}

void SyntheticWorld::AddImages(int first, int last, const Similarity& frame,
                               Reconstruction* model) const {
  for (int id = first; id <= last; ++id) {
    const PhotoInput& photo = scene_.photos.at(id - 1);
    Image image;
    image.SetImageId(id);
    image.SetName(photo.name);
    image.SetCameraId(static_cast<CameraId>(photo.camera_id));
    const CameraPose pose = TransformPose(frame, Pose(id));
    const Eigen::Quaterniond& q = pose.rotation;
    image.SetQvec({q.w(), q.x(), q.y(), q.z()});
    image.SetTvec(pose.translation);
    std::vector<Eigen::Vector2d> pixels;
    for (const Keypoint& keypoint : photo.keypoints) pixels.emplace_back(keypoint.x, keypoint.y);
    image.SetPoints2D(pixels);
    model->AddImage(image);
    model->RegisterImage(id);
  }
}

void SyntheticWorld::AddPoints(int first, int last, const Similarity& frame,
                               Reconstruction* model) const {
  std::map<int, Track> tracks;
  for (int id = first; id <= last; ++id) {
    const std::vector<int>& visible = scene_.visible[id - 1];
    for (size_t k = 0; k < visible.size(); ++k) {
      if (visible[k] >= 0) tracks[visible[k]].AddElement(id, k);
    }
  }
  for (const auto& [point, track] : tracks) {
    if (track.Length() >= 2) model->AddPoint3D(frame.Apply(scene_.points[point]), track);
  }
}

Reconstruction SyntheticWorld::Submap(int first, int last, const Similarity& submap_from_world,
                                      double focal_factor) const {
  Reconstruction model;
  for (int id = first; id <= last; ++id) {
    const auto camera_id = static_cast<CameraId>(scene_.photos.at(id - 1).camera_id);
    if (model.ExistsCamera(camera_id)) continue;
    Camera camera;
    camera.SetCameraId(camera_id);
    camera.InitializeWithName("SIMPLE_RADIAL", TrueFocalPx() * focal_factor,
                              options_.camera.width_px, options_.camera.height_px);
    camera.Params(3) = options_.camera.distortion;
    model.AddCamera(camera);
  }
  AddImages(first, last, submap_from_world, &model);
  AddPoints(first, last, submap_from_world, &model);
  SeamIntrinsics never;
  never.min_images = last - first + 2;
  AdjustSeam({model.RegImageIds().begin(), model.RegImageIds().end()}, never, &model);
  return model;
}

}  // namespace skein
