#include "testing/synthetic_scene.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/angles.h"
#include "map/image_pose.h"
#include "sfm/camera.h"
#include "testing/test_random.h"

namespace skein {
namespace {

constexpr double kDistance = 8;
constexpr int kNumInFirstPlace = 12;
constexpr size_t kMinPairMatches = 15;

Eigen::Vector3d RandomPoint(SyntheticOptions::Shape shape, std::mt19937* random) {
  Eigen::Vector3d point = Uniform3(-2, 2, random);
  if (shape == SyntheticOptions::Shape::kTwins) point.x() = 0.5 * point.x() - 1.0;
  if (shape == SyntheticOptions::Shape::kPlane) point.z() = 0;
  return point;
}

void AddWall(const SyntheticOptions& options, std::mt19937* random, SyntheticScene* scene) {
  const bool two = options.shape == SyntheticOptions::Shape::kTwoPlaces;
  const double end = (two ? 8.0 : kWallLength) + 4;
  for (int i = 0; i < options.num_points; ++i) {
    const double x = Uniform(-4, end, random), y = Uniform(-4, 4, random);
    scene->points.emplace_back(x, y, Uniform(6, 9, random));
    // The façade is the upper part; below are the surroundings.
    scene->place_of_point.push_back(!two || y < -0.8 ? 0 : 1 + i % 2);
  }
  for (int i = 0; i < options.num_photos; ++i) {
    const double step =
        two ? 0.6 * (i % kNumInFirstPlace) : kWallLength * i / (options.num_photos - 1);
    const Eigen::Vector3d center = Eigen::Vector3d(step, 0, 0) + Normal3(0.2, random);
    const Eigen::Vector3d tilt = Normal3(0.03, random);
    scene->AddPose(Eigen::Quaterniond(1, tilt.x(), tilt.y(), tilt.z()).normalized().matrix(),
                   center);
    scene->place_of_photo.push_back(i < kNumInFirstPlace ? 1 : 2);
  }
}

void AddBox(const SyntheticOptions& options, std::mt19937* random, SyntheticScene* scene) {
  for (int p = 0; p < options.num_points; ++p) {
    const int twin = p - options.num_points / 2;
    const bool is_twin = options.shape == SyntheticOptions::Shape::kTwins && twin >= 0;
    scene->points.push_back(is_twin ? scene->points[twin] + Eigen::Vector3d(kTwinShift, 0, 0)
                                    : RandomPoint(options.shape, random));
  }
}

void AddPoseOnPath(const SyntheticOptions& options, int i, SyntheticScene* scene) {
  const double angle = DegToRad((i - 0.5 * options.num_photos) * options.step_deg);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).matrix();
  Eigen::Matrix3d R = turn;
  Eigen::Vector3d center = turn.transpose() * Eigen::Vector3d(0, 0.1 * (i % 3), -kDistance);
  if (options.path == SyntheticOptions::Path::kForward) {
    R.setIdentity();
    center = {0, 0, -kDistance + 0.4 * i};
  }
  const int ahead = i - options.num_photos / 2;
  if (options.path == SyntheticOptions::Path::kArcThenForward && ahead > 0) {
    R = scene->rotations[options.num_photos / 2];
    center =
        scene->Center(options.num_photos / 2) + R.transpose() * Eigen::Vector3d(0, 0, 0.4 * ahead);
  }
  if (i == options.turned_photo) {
    constexpr double kTurnRad = DegToRad(8);
    R = Eigen::AngleAxisd(kTurnRad, Eigen::Vector3d::UnitY()).matrix() * scene->rotations[i - 1];
    center = scene->Center(i - 1) + Eigen::Vector3d(options.turned_distance, 0, 0);
  }
  if (options.path == SyntheticOptions::Path::kRotation) center = {0, 0, -kDistance};
  scene->AddPose(R, center);
}

bool Observe(const SyntheticOptions& options, const Eigen::Vector3d& in_cam, std::mt19937* random,
             Keypoint* keypoint) {
  if (in_cam.z() <= 0.1) return false;
  std::normal_distribution<double> noise(0.0, options.noise_px);
  const double u = in_cam.x() / in_cam.z(), v = in_cam.y() / in_cam.z();
  const double fd = options.camera.focal_px * (1 + options.camera.distortion * (u * u + v * v));
  keypoint->x = static_cast<float>(fd * u + options.camera.width_px / 2.0 + noise(*random));
  keypoint->y = static_cast<float>(fd * v + options.camera.height_px / 2.0 + noise(*random));
  return keypoint->x > 0 && keypoint->y > 0 && keypoint->x < options.camera.width_px &&
         keypoint->y < options.camera.height_px;
}

bool Stands(const SyntheticScene& scene, size_t point, size_t photo) {
  if (scene.place_of_point.empty() || scene.place_of_point[point] == 0) return true;
  return scene.place_of_point[point] == scene.place_of_photo[photo];
}

void AddPhoto(const SyntheticOptions& options, int i, std::mt19937* random, SyntheticScene* scene) {
  PhotoInput photo;
  photo.image_id = i + 1;
  const bool second = options.second_camera_from > 0 && i + 1 >= options.second_camera_from;
  photo.camera_id = second ? 2 : 1;
  photo.name = "test/" + std::to_string(i) + ".jpg";
  photo.width_px = options.camera.width_px;
  photo.height_px = options.camera.height_px;
  photo.focal_px = options.camera.focal_px * options.prior_factor;
  photo.focal_from_exif = options.focal_from_exif;
  SyntheticOptions lens = options;
  for (const int zoomed : options.zoomed_photos)
    lens.camera.focal_px *= zoomed == i ? options.zoom : 1.0;
  std::vector<int> visible;
  for (size_t p = 0; p < scene->points.size(); ++p) {
    Keypoint keypoint;
    const Eigen::Vector3d in_cam = scene->rotations[i] * scene->points[p] + scene->translations[i];
    if (!Stands(*scene, p, i) || !Observe(lens, in_cam, random, &keypoint)) continue;
    const double detection =
        scene->detection_of_point.empty() ? options.detection_rate : scene->detection_of_point[p];
    if (detection < 1 && Uniform(0, 1, random) >= detection) continue;
    photo.keypoints.push_back(keypoint);
    visible.push_back(static_cast<int>(p));
  }
  for (int k = 0; k < options.num_clutter; ++k) {
    Keypoint keypoint;
    keypoint.x = static_cast<float>(Uniform(0, options.camera.width_px, random));
    keypoint.y = static_cast<float>(Uniform(0, options.camera.height_px, random));
    photo.keypoints.push_back(keypoint);
    visible.push_back(-1);
  }
  scene->photos.push_back(photo);
  scene->visible.push_back(visible);
}

TwoViewPair MakePair(const SyntheticOptions& options, const SyntheticScene& scene, size_t a,
                     size_t b, std::mt19937* random) {
  TwoViewPair pair;
  pair.other_id = static_cast<int64_t>(b) + 1;
  const std::vector<int>&of_a = scene.visible[a], &of_b = scene.visible[b];
  for (size_t k = 0, l = 0; k < of_a.size() && of_a[k] >= 0; ++k) {
    while (l < of_b.size() && of_b[l] >= 0 && of_b[l] < of_a[k]) ++l;
    if (l < of_b.size() && of_b[l] == of_a[k]) {
      pair.inliers.emplace_back(static_cast<uint32_t>(k), static_cast<uint32_t>(l));
    }
  }
  // Outliers: neighbours in the list exchange their partners.
  std::bernoulli_distribution is_outlier(options.outlier_ratio);
  for (size_t k = 0; k + 1 < pair.inliers.size(); k += 2) {
    if (is_outlier(*random)) std::swap(pair.inliers[k].second, pair.inliers[k + 1].second);
  }
  return pair;
}

void Check(const Status& status) {
  if (!status.ok()) throw std::logic_error(status.error());
}

}  // namespace

void PhotographNext(const SyntheticOptions& options, std::mt19937* random, SyntheticScene* scene) {
  const int i = static_cast<int>(scene->photos.size());
  AddPhoto(options, i, random, scene);
  TwoViewPairs pairs;
  for (int j = options.max_pairs > 0 ? std::max(0, i - options.max_pairs) : 0; j < i; ++j) {
    TwoViewPair pair = MakePair(options, *scene, i, j, random);
    if (pair.inliers.size() >= kMinPairMatches) pairs.push_back(std::move(pair));
  }
  scene->pairs.push_back(std::move(pairs));
}

void Photograph(const SyntheticOptions& options, std::mt19937* random, SyntheticScene* scene) {
  while (scene->photos.size() < scene->rotations.size()) PhotographNext(options, random, scene);
}

SyntheticScene MakeScene(const SyntheticOptions& options) {
  using Shape = SyntheticOptions::Shape;
  std::mt19937 random(options.seed);
  SyntheticScene scene;
  if (options.shape == Shape::kWall || options.shape == Shape::kTwoPlaces) {
    AddWall(options, &random, &scene);
  } else {
    AddBox(options, &random, &scene);
    for (int i = 0; i < options.num_photos; ++i) AddPoseOnPath(options, i, &scene);
  }
  Photograph(options, &random, &scene);
  return scene;
}

void AddToMap(const SyntheticScene& scene, const std::vector<TwoViewPairs>& pairs, SceneMap* map) {
  for (size_t i = 0; i < scene.photos.size(); ++i) {
    Check(map->AddPhoto(scene.photos[i]));
    Check(map->AddPairs(scene.photos[i].image_id, pairs[i]));
  }
}

void RegisterAtTruth(const SyntheticScene& scene, const std::vector<ImageId>& ids,
                     const Eigen::Vector3d& shift, SceneMap* map) {
  std::vector<Track> tracks(scene.points.size());
  for (const ImageId id : ids) {
    BundlePose pose;
    pose.image_id = id;
    pose.R = scene.rotations[id - 1];
    pose.t = scene.translations[id - 1] - pose.R * shift;
    map->SetPose(pose);
    map->Register(id);
    for (size_t k = 0; k < scene.visible[id - 1].size(); ++k) {
      const int point = scene.visible[id - 1][k];
      if (point >= 0) tracks[point].AddElement(id, static_cast<Point2DIdx>(k));
    }
  }
  for (size_t p = 0; p < tracks.size(); ++p) {
    if (tracks[p].Length() < 2) continue;
    map->AddPoint(scene.points[p] + shift, tracks[p]);
  }
}

Bundle BundleAtTruth(const SyntheticOptions& options, const SyntheticScene& scene) {
  Bundle bundle;
  BundleCamera camera;
  camera.camera_id = 1;
  camera.model_id = kSimpleRadial;
  camera.params = {options.camera.focal_px, options.camera.width_px / 2.0,
                   options.camera.height_px / 2.0, options.camera.distortion};
  bundle.cameras.push_back(camera);
  std::vector<std::vector<BundleObservation>> of_point(scene.points.size());
  for (size_t i = 0; i < scene.photos.size(); ++i) {
    BundlePose pose;
    pose.image_id = static_cast<uint32_t>(i + 1);
    pose.R = scene.rotations[i];
    pose.t = scene.translations[i];
    bundle.poses.push_back(pose);
    for (size_t k = 0; k < scene.visible[i].size() && scene.visible[i][k] >= 0; ++k) {
      const Keypoint& keypoint = scene.photos[i].keypoints[k];
      of_point[scene.visible[i][k]].push_back(
          {static_cast<int>(i), static_cast<uint32_t>(k), {keypoint.x, keypoint.y}});
    }
  }
  for (size_t p = 0; p < of_point.size(); ++p) {
    if (of_point[p].size() < 2) continue;
    BundlePoint point;
    point.point3D_id = p;
    point.xyz = scene.points[p];
    point.first = static_cast<int>(bundle.observations.size());
    point.count = static_cast<int>(of_point[p].size());
    bundle.points.push_back(point);
    bundle.observations.insert(bundle.observations.end(), of_point[p].begin(), of_point[p].end());
  }
  return bundle;
}

void FillMap(const SyntheticScene& scene, SceneMap* map) {
  AddToMap(scene, scene.pairs, map);
  RegisterAtTruth(scene, map->photos(), Eigen::Vector3d::Zero(), map);
}

size_t NumSeen(const SceneMap& map, const std::vector<Point3DId>& points, ImageId id) {
  return std::count_if(points.begin(), points.end(), [&](Point3DId point) {
    return map.reconstruction().Point3D(point).Track().HasImage(id);
  });
}

}  // namespace skein
