#include "merging/synthetic_submaps.h"

#include <map>
#include <random>
#include <set>

#include "merging/seam_bundle.h"

namespace skein {
namespace {

constexpr int kWidth = 1600, kHeight = 1200;
constexpr double kLength = 20.0;  // of the photos' path
constexpr int kFirstOfSecondPlace = 13;
constexpr int kNumClutter = 300;

using Random = std::mt19937_64;

double Uniform(double low, double high, Random* random) {
  return std::uniform_real_distribution<double>(low, high)(*random);
}

Eigen::Vector3d Normal3(double sigma, Random* random) {
  std::normal_distribution<double> normal(0, sigma);
  return {normal(*random), normal(*random), normal(*random)};
}

}  // namespace

SyntheticWorld::SyntheticWorld(const SyntheticOptions& options, uint64_t seed) : options_(options) {
  MakePoints(seed);
  MakePoses(seed + 1);
  Photograph(seed + 2);
}

void SyntheticWorld::MakePoints(uint64_t seed) {
  Random random(seed);
  const double length = options_.twin ? 8.0 : kLength;
  for (int i = 0; i < options_.num_points; ++i) {
    const double y = Uniform(-4, 4, &random);
    points_.emplace_back(Uniform(-4, length + 4, &random), y, Uniform(6, 9, &random));
    // The façade is the upper part; below are the surroundings.
    const bool common = !options_.twin || y < -0.8;
    places_.push_back(common ? 0 : 1 + i % 2);
  }
}

void SyntheticWorld::MakePoses(uint64_t seed) {
  Random random(seed);
  for (int i = 0; i < options_.num_images; ++i) {
    const double step = options_.twin ? 0.6 * (i % (kFirstOfSecondPlace - 1))
                                      : kLength * i / (options_.num_images - 1);
    const Eigen::Vector3d centre = Eigen::Vector3d(step, 0, 0) + Normal3(0.2, &random);
    const Eigen::Vector3d tilt = Normal3(0.03, &random);
    CameraPose pose;
    pose.rotation = Eigen::Quaterniond(1, tilt.x(), tilt.y(), tilt.z()).normalized();
    pose.translation = -(pose.rotation * centre);
    poses_.push_back(pose);
  }
}

colmap::Camera SyntheticWorld::TrueCamera() const {
  colmap::Camera camera;
  camera.SetCameraId(1);
  camera.InitializeWithName("SIMPLE_RADIAL", TrueFocalPx(), kWidth, kHeight);
  camera.Params(3) = -0.03;
  return camera;
}

bool SyntheticWorld::Stands(int image_id, int point) const {
  const int place = image_id < kFirstOfSecondPlace ? 1 : 2;
  return places_[point] == 0 || places_[point] == place;
}

void SyntheticWorld::Photograph(uint64_t seed) {
  Random random(seed);
  const colmap::Camera camera = TrueCamera();
  keypoints_.resize(poses_.size());
  for (size_t i = 0; i < poses_.size(); ++i) {
    for (int k = 0; k < options_.num_points; ++k) {
      const bool detected = Uniform(0, 1, &random) < options_.detection_rate;
      const Eigen::Vector3d noise = Normal3(options_.noise_px, &random);
      const Eigen::Vector3d in_camera = poses_[i].Apply(points_[k]);
      const Eigen::Vector2d pixel = camera.WorldToImage(in_camera.hnormalized()) + noise.head<2>();
      const bool inside =
          pixel.x() >= 0 && pixel.x() < kWidth && pixel.y() >= 0 && pixel.y() < kHeight;
      if (detected && inside && Stands(static_cast<int>(i) + 1, k)) {
        keypoints_[i].push_back({k, pixel});
      }
    }
    for (int k = 0; k < kNumClutter; ++k) {
      keypoints_[i].push_back({-1, {Uniform(0, kWidth, &random), Uniform(0, kHeight, &random)}});
    }
  }
}

int SyntheticWorld::CameraOf(int image_id) const {
  return options_.second_camera_from > 0 && image_id >= options_.second_camera_from ? 2 : 1;
}

void SyntheticWorld::AddImages(int first, int last, const Similarity& frame,
                               colmap::Reconstruction* model) const {
  for (int id = first; id <= last; ++id) {
    colmap::Image image;
    image.SetImageId(id);
    image.SetName("photo" + std::to_string(id));
    image.SetCameraId(CameraOf(id));
    const CameraPose pose = TransformPose(frame, Pose(id));
    const Eigen::Quaterniond& q = pose.rotation;
    image.SetQvec({q.w(), q.x(), q.y(), q.z()});
    image.SetTvec(pose.translation);
    std::vector<Eigen::Vector2d> pixels;
    for (const Keypoint& keypoint : keypoints_[id - 1]) pixels.push_back(keypoint.pixel);
    image.SetPoints2D(pixels);
    model->AddImage(image);
    model->RegisterImage(id);
  }
}

void SyntheticWorld::AddPoints(int first, int last, const Similarity& frame,
                               colmap::Reconstruction* model) const {
  std::map<int, colmap::Track> tracks;
  for (int id = first; id <= last; ++id) {
    for (size_t k = 0; k < keypoints_[id - 1].size(); ++k) {
      const int point = keypoints_[id - 1][k].point;
      if (point >= 0) tracks[point].AddElement(id, k);
    }
  }
  for (const auto& [point, track] : tracks) {
    if (track.Length() >= 2) model->AddPoint3D(frame.Apply(points_[point]), track);
  }
}

colmap::Reconstruction SyntheticWorld::Submap(int first, int last,
                                              const Similarity& submap_from_world,
                                              double focal_factor) const {
  colmap::Reconstruction model;
  std::set<int> camera_ids;
  for (int id = first; id <= last; ++id) camera_ids.insert(CameraOf(id));
  for (const int camera_id : camera_ids) {
    colmap::Camera camera = TrueCamera();
    camera.SetCameraId(camera_id);
    camera.SetFocalLength(TrueFocalPx() * focal_factor);
    model.AddCamera(camera);
  }
  AddImages(first, last, submap_from_world, &model);
  AddPoints(first, last, submap_from_world, &model);
  const int never = last - first + 2;
  AdjustSeam({model.RegImageIds().begin(), model.RegImageIds().end()}, never, &model);
  return model;
}

}  // namespace skein
