#include "benchmark/support/synthetic_pool.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <stdexcept>

#include "clients/places/parallel.h"
#include "clients/places/render.h"
#include "features/photo_texture.h"

namespace skein {
namespace {

using sim::kDegree;

// Change of a walk's camera pose for a further photo: turned, moved towards its target, lifted.
struct Variant {
  double turn_deg, forward_share, lift_m;
};
constexpr Variant kVariants[] = {{0, 0, 0}, {-25, 0.3, 0}, {25, 0, 1.5}, {0, 0.45, 0}};
constexpr double kClearanceM = 0.8;

constexpr int kCornersPerPhoto = 220;
constexpr double kDetected = 0.6, kNoisePx = 0.5;
constexpr double kMaxIncidenceDeg = 72, kMaxMatchDeg = 30, kMaxScaleRatio = 2;
constexpr int kMinFromMap = 2;

constexpr int kSamplesPerPhoto = 500;
constexpr double kSampleSpacingPx = 6;  // between samples, of the median one

double FreeWay(const sim::Scene& scene, const Eigen::Vector3d& from, const Eigen::Vector3d& dir,
               double wanted) {
  const sim::Hit hit = scene.Trace(from.cast<float>(), dir.cast<float>());
  return hit.surface < 0 ? wanted : std::min(wanted, std::max(0.0, hit.t - kClearanceM));
}

sim::Pose Vary(const sim::Scene& scene, const sim::Pose& pose, const Variant& variant) {
  const Eigen::Vector3d forward = pose.cam_from_world.conjugate() * Eigen::Vector3d::UnitZ();
  const sim::Hit hit = scene.Trace(pose.center.cast<float>(), forward.cast<float>());
  const double distance = hit.surface < 0 ? 10 : hit.t;
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d center = pose.center;
  center += FreeWay(scene, center, forward, variant.forward_share * distance) * forward;
  center += FreeWay(scene, center, up, variant.lift_m) * up;
  const Eigen::Vector3d target = pose.center + distance * forward;
  const Eigen::AngleAxisd turn(variant.turn_deg * kDegree, up);
  return sim::LookAt(center, center + turn * (target - center), 0);
}

std::string CachedPhoto(const SyntheticPoolOptions& options, int i) {
  const sim::ScenarioOptions& s = options.scenario;
  std::string scenario;
  for (const std::string& name : sim::ScenarioNames()) {
    if (sim::ParseScenario(name) == s.scenario) scenario = name;
  }
  const std::string folder = options.cache + "/" + scenario + "-" + std::to_string(s.seed) + "-" +
                             std::to_string(s.agents) + "x" + std::to_string(s.photos) + "-" +
                             std::to_string(options.width) + "x" + std::to_string(options.height);
  std::filesystem::create_directories(folder);
  return folder + "/" + std::to_string(i) + ".png";
}

Eigen::Vector3d RayOf(const GuidedCamera& camera, const CameraPose& pose,
                      const Eigen::Vector2d& pixel) {
  const Eigen::Vector3d in_camera((pixel.x() - camera.cx_px) / camera.fx_px,
                                  (pixel.y() - camera.cy_px) / camera.fy_px, 1);
  return pose.rotation.conjugate() * in_camera;
}

bool InPhoto(const GuidedCamera& camera, const CameraPose& pose, const Eigen::Vector3d& xyz,
             Eigen::Vector2d* pixel) {
  const Eigen::Vector3d in_camera = pose.Apply(xyz);
  if (in_camera.z() <= 0) return false;
  *pixel = {camera.fx_px * in_camera.x() / in_camera.z() + camera.cx_px,
            camera.fy_px * in_camera.y() / in_camera.z() + camera.cy_px};
  return pixel->x() > 0 && pixel->y() > 0 && pixel->x() < camera.width_px &&
         pixel->y() < camera.height_px;
}

struct Ray {
  Eigen::Vector3d from, direction;  // direction of unit length
};

// Least squares of the distances to the rays, each weighted by its length, so that errors are
// those in the photos. nullopt: the rays are parallel.
std::optional<Eigen::Vector3d> Intersect(const std::vector<Ray>& rays) {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  for (int round = 0; round < 2; ++round) {
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (const Ray& ray : rays) {
      const double distance = round == 0 ? 1 : (point - ray.from).norm();
      const Eigen::Matrix3d across =
          (Eigen::Matrix3d::Identity() - ray.direction * ray.direction.transpose()) /
          (distance * distance);
      a += across;
      b += across * ray.from;
    }
    Eigen::FullPivLU<Eigen::Matrix3d> solver(a);
    solver.setThreshold(1e-7);
    if (!solver.isInvertible()) return std::nullopt;
    point = solver.solve(b);
  }
  return point;
}

}  // namespace

SyntheticPool::SyntheticPool(const SyntheticPoolOptions& options)
    : place_(sim::BuildPlace(options.scenario, options.threads)) {
  PlanPhotos(options);
  RenderPhotos(options);
  FindPoints(options.threads);
  TakeSamples();
}

void SyntheticPool::PlanPhotos(const SyntheticPoolOptions& options) {
  sim_camera_ = {options.width, options.height, 0.86 * options.width, 0};
  const Eigen::Vector2d middle = sim_camera_.PrincipalPoint();
  camera_ = {options.width,        options.height, sim_camera_.focal_px,
             sim_camera_.focal_px, middle.x(),     middle.y()};
  cameras_ = {camera_};
  int walk_number = 0;
  for (const Variant& variant : kVariants) {
    for (const sim::Walk& walk : sim::PlanWalks(options.scenario)) {
      for (const sim::Shot& shot : walk.shots) {
        const sim::Pose pose = Vary(place_.scene, shot.pose, variant);
        poses_.push_back(pose);
        photos_.push_back({static_cast<int64_t>(photos_.size()) + 1,
                           0,
                           walk_number,
                           {pose.cam_from_world, pose.Translation()}});
      }
      ++walk_number;
    }
  }
}

void SyntheticPool::RenderPhotos(const SyntheticPoolOptions& options) {
  greys_.resize(photos_.size());
  sim::ParallelFor(size(), options.threads, [&](int i) {
    const std::string file = CachedPhoto(options, i);
    cv::Mat1b grey;
    if (std::filesystem::exists(file)) grey = cv::imread(file, cv::IMREAD_GRAYSCALE);
    if (grey.empty()) {
      grey = Render(i);
      if (!cv::imwrite(file + ".part.png", grey)) throw std::runtime_error("cannot write " + file);
      std::filesystem::rename(file + ".part.png", file);
    }
    grey.convertTo(greys_[i], CV_32F);
    photos_[i].texture = FindTexture(grey);
  });
}

cv::Mat1b SyntheticPool::Render(int photo) const {
  sim::Exposure exposure;
  exposure.seed = photo;
  cv::Mat1b grey;
  cv::cvtColor(sim::RenderPhoto(place_, sim_camera_, poses_[photo], exposure), grey,
               cv::COLOR_BGR2GRAY);
  return grey;
}

int SyntheticPool::Add(const CameraPose& cam_from_world, int agent) {
  const int added = size();
  photos_.push_back({added + 1, 0, agent, cam_from_world});
  poses_.push_back({cam_from_world.rotation, cam_from_world.Centre()});
  greys_.emplace_back();
  const cv::Mat1b grey = Render(added);
  grey.convertTo(greys_.back(), CV_32F);
  photos_.back().texture = FindTexture(grey);
  points_of_photo_.emplace_back();
  const sim::Random random(0x61646465ULL + added);
  for (size_t p = 0; p < points_.size(); ++p) {
    sim::Random of_point = random.Fork(p);
    if (Observe(added, &of_point, &points_[p])) {
      points_of_photo_[added].push_back(static_cast<int>(p));
    }
  }
  AddPoints(PointsAtCorners(added));
  return added;
}

bool SyntheticPool::Shows(int photo, const SurfaceSample& sample) const {
  Eigen::Vector2d pixel;
  if (!InPhoto(camera_, photos_[photo].cam_from_world, sample.xyz, &pixel)) return false;
  const Eigen::Vector3d to = poses_[photo].center - sample.xyz;
  const double cosine = std::abs(sample.normal.dot(to)) / to.norm();
  if (cosine < std::cos(kMaxIncidenceDeg * kDegree)) return false;
  const Eigen::Vector3f from = poses_[photo].center.cast<float>();
  return !place_.scene.Occluded(from, (-to).cast<float>(), 1 - 1e-3f);
}

bool SyntheticPool::Observe(int photo, sim::Random* random, TruePoint* point) const {
  if (!Shows(photo, {point->xyz, point->normal})) return false;
  if (!random->Chance(kDetected)) return false;
  Eigen::Vector2d pixel;
  InPhoto(camera_, photos_[photo].cam_from_world, point->xyz, &pixel);
  const Eigen::Vector3d to = poses_[photo].center - point->xyz;
  pixel += kNoisePx * Eigen::Vector2d(random->Gaussian(), random->Gaussian());
  point->observations.push_back({photo, pixel, to.normalized(), to.norm()});
  return true;
}

std::vector<SyntheticPool::TruePoint> SyntheticPool::PointsAtCorners(int photo) const {
  cv::Mat1b grey;
  greys_[photo].convertTo(grey, CV_8U);
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(grey, corners, kCornersPerPhoto, 0.01, 5);
  std::vector<TruePoint> points;
  for (size_t c = 0; c < corners.size(); ++c) {
    const sim::Pose& pose = poses_[photo];
    const Eigen::Vector3d ray =
        RayOf(camera_, photos_[photo].cam_from_world, {corners[c].x + 0.5, corners[c].y + 0.5});
    const sim::Hit hit = place_.scene.Trace(pose.center.cast<float>(), ray.cast<float>());
    if (hit.surface < 0) continue;
    TruePoint point;
    point.xyz = pose.center + hit.t * ray;
    point.normal = place_.scene.surface(hit.surface).normal.cast<double>();
    sim::Random random = sim::Random(0x706f6f6cULL + photo).Fork(c);
    for (int k = 0; k < size(); ++k) Observe(k, &random, &point);
    if (point.observations.size() >= 2) points.push_back(std::move(point));
  }
  return points;
}

void SyntheticPool::FindPoints(int threads) {
  std::vector<std::vector<TruePoint>> found(photos_.size());
  sim::ParallelFor(size(), threads, [&](int i) { found[i] = PointsAtCorners(i); });
  points_of_photo_.resize(photos_.size());
  for (auto& of_photo : found) AddPoints(std::move(of_photo));
}

void SyntheticPool::AddPoints(std::vector<TruePoint> points) {
  for (TruePoint& point : points) {
    for (const Observation& o : point.observations) {
      points_of_photo_[o.photo].push_back(static_cast<int>(points_.size()));
    }
    points_.push_back(std::move(point));
  }
}

void SyntheticPool::TakeSamples() {
  std::vector<SurfaceSample> all;
  std::vector<double> gsd;
  for (int i = 0; i < size(); ++i) {
    sim::Random random = sim::Random(0x73616d70ULL).Fork(i);
    for (int k = 0; k < kSamplesPerPhoto; ++k) {
      const Eigen::Vector2d pixel(random.Uniform(0, camera_.width_px),
                                  random.Uniform(0, camera_.height_px));
      const Eigen::Vector3d ray = RayOf(camera_, photos_[i].cam_from_world, pixel);
      const sim::Hit hit = place_.scene.Trace(poses_[i].center.cast<float>(), ray.cast<float>());
      if (hit.surface < 0) continue;
      const Eigen::Vector3d normal = place_.scene.surface(hit.surface).normal.cast<double>();
      all.push_back({poses_[i].center + hit.t * ray, normal.dot(ray) < 0 ? normal : -normal});
      gsd.push_back(hit.t / camera_.fx_px);
    }
  }
  if (all.empty()) throw std::runtime_error("the photos of this scenario show nothing");
  std::nth_element(gsd.begin(), gsd.begin() + gsd.size() / 2, gsd.end());
  samples_ = ThinOut(all, kSampleSpacingPx * gsd[gsd.size() / 2]);
}

bool SyntheticPool::Matched(const Observation& a, const Observation& b) const {
  const double ratio = a.distance / b.distance;
  return a.direction.dot(b.direction) > std::cos(kMaxMatchDeg * kDegree) &&
         ratio < kMaxScaleRatio && ratio > 1 / kMaxScaleRatio;
}

// Connected components of the matches.
std::vector<SyntheticPool::Observations> SyntheticPool::TracksOf(
    const Observations& all, const std::vector<int>& place_of_photo) const {
  Observations open;
  for (const Observation& o : all) {
    if (place_of_photo[o.photo] >= 0) open.push_back(o);
  }
  std::vector<Observations> tracks;
  while (!open.empty()) {
    Observations track = {open.back()};
    open.pop_back();
    for (size_t i = 0; i < track.size(); ++i) {
      const Observation from = track[i];
      const auto rest = std::stable_partition(
          open.begin(), open.end(), [&](const Observation& o) { return !Matched(from, o); });
      track.insert(track.end(), rest, open.end());
      open.erase(rest, open.end());
    }
    if (track.size() >= 2) tracks.push_back(std::move(track));
  }
  return tracks;
}

void SyntheticPool::AddPoint(const Observations& track, const std::vector<int>& place_of_photo,
                             PoolMap* map) const {
  double parallax_cosine = 1;
  std::vector<Ray> rays;
  for (const Observation& o : track) {
    const CameraPose& pose = photos_[o.photo].cam_from_world;
    rays.push_back({pose.Centre(), RayOf(camera_, pose, o.pixel).normalized()});
    for (const Observation& other : track) {
      parallax_cosine = std::min(parallax_cosine, o.direction.dot(other.direction));
    }
  }
  if (parallax_cosine > std::cos(kMinParallaxDeg * kDegree)) return;
  const std::optional<Eigen::Vector3d> xyz = Intersect(rays);
  if (!xyz) return;
  GuidedPoint point;
  point.xyz = *xyz;
  double error_px = 0;
  for (const Observation& o : track) {
    Eigen::Vector2d pixel;
    if (!InPhoto(camera_, photos_[o.photo].cam_from_world, *xyz, &pixel)) return;
    error_px += (pixel - o.pixel).norm() / static_cast<double>(track.size());
    point.photos.push_back(place_of_photo[o.photo]);
  }
  std::sort(point.photos.begin(), point.photos.end());
  map->map.points.push_back(std::move(point));
  map->error_px.push_back(error_px);
}

PoolMap SyntheticPool::MapOf(const std::vector<int>& taken) const {
  PoolMap map = EmptyMapOf(taken);
  const std::vector<int> place_of_photo = PlacesIn(taken);
  for (const TruePoint& point : points_) {
    for (const Observations& track : TracksOf(point.observations, place_of_photo)) {
      AddPoint(track, place_of_photo, &map);
    }
  }
  return map;
}

int SyntheticPool::CommonPoints(int photo, const std::vector<int>& taken) const {
  const std::vector<int> places = PlacesIn(taken);
  int common = 0;
  for (const int p : points_of_photo_[photo]) {
    const Observations& all = points_[p].observations;
    const auto own = std::find_if(all.begin(), all.end(),
                                  [&](const Observation& o) { return o.photo == photo; });
    int observers = 0;
    bool matched = false;
    for (const Observation& o : all) {
      if (places[o.photo] < 0 || o.photo == photo) continue;
      ++observers;
      matched = matched || Matched(*own, o);
    }
    common += matched && observers >= kMinFromMap;
  }
  return common;
}

}  // namespace skein
