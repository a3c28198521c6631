#include "benchmark/support/model_pool.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "benchmark/support/undistortion.h"
#include "clients/places/parallel.h"
#include "codecs/image_decoding.h"
#include "core/file.h"
#include "features/photo_texture.h"
#include "sfm/model_files.h"

namespace skein {
namespace {

using ImageIds = std::vector<ImageId>;

ImageIds RegisteredByName(const Reconstruction& model) {
  ImageIds ids = model.RegImageIds();
  std::sort(ids.begin(), ids.end(),
            [&](ImageId a, ImageId b) { return model.Image(a).Name() < model.Image(b).Name(); });
  return ids;
}

Reconstruction ReadModel(const std::string& folder) {
  Result<Reconstruction> model = ReadModelFiles(folder);
  if (!model) throw std::runtime_error(model.error());
  if (model->NumRegImages() < 2 || model->NumPoints3D() == 0) {
    throw std::runtime_error(folder + ": a pool needs a model with two photos and points");
  }
  return std::move(*model);
}

CameraPose CamFromWorldOf(const Image& image) {
  const Eigen::Vector4d& q = image.Qvec();
  return {Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized(), image.Tvec()};
}

cv::Mat1b ReadGrey(const std::string& path, const Camera& camera) {
  const Result<Bytes> bytes = ReadFile(path);
  if (!bytes) throw std::runtime_error(bytes.error());
  const Result<cv::Mat> photo = DecodePhoto(*bytes);
  if (!photo) throw std::runtime_error(path + ": " + photo.error());
  if (static_cast<size_t>(photo->cols) != camera.Width() ||
      static_cast<size_t>(photo->rows) != camera.Height()) {
    throw std::runtime_error(path + ": not of its camera's size; give the photos of the model");
  }
  cv::Mat1b grey;
  cv::cvtColor(*photo, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

bool IsInPhoto(const GuidedCamera& camera, const Eigen::Vector2d& pixel) {
  return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < camera.width_px &&
         pixel.y() < camera.height_px;
}

}  // namespace

ModelPool::ModelPool(const ModelPoolOptions& options) {
  const Reconstruction model = ReadModel(options.model);
  AddPhotos(model, options);
  AddPoints(model);
}

void ModelPool::AddPhotos(const Reconstruction& model, const ModelPoolOptions& options) {
  std::map<CameraId, int> index_of;
  std::map<std::string, int> agents;
  const ImageIds ids = RegisteredByName(model);
  for (const ImageId id : ids) {
    const Image& image = model.Image(id);
    const CameraId camera_id = image.CameraId();
    const auto [camera, is_new] = index_of.try_emplace(camera_id, undistortions_.size());
    if (is_new) undistortions_.emplace_back(model.Camera(camera_id), options.width);
    const std::string folder = std::filesystem::path(image.Name()).parent_path().string();
    const int agent = agents.try_emplace(folder, static_cast<int>(agents.size())).first->second;
    photos_.push_back({id, camera->second, agent, CamFromWorldOf(image)});
  }
  for (const Undistortion& u : undistortions_) cameras_.push_back(u.camera());
  greys_.resize(ids.size());
  sim::ParallelFor(size(), options.threads, [&](int i) {
    const Image& image = model.Image(ids[i]);
    const cv::Mat1b grey =
        ReadGrey(options.images + "/" + image.Name(), model.Camera(image.CameraId()));
    const cv::Mat1b undistorted = undistortions_[photos_[i].camera].Photo(grey);
    photos_[i].texture = FindTexture(undistorted);
    undistorted.convertTo(greys_[i], CV_32F);
  });
}

void ModelPool::AddPoints(const Reconstruction& model) {
  std::map<int64_t, int> photo_of;
  for (int i = 0; i < size(); ++i) photo_of[photos_[i].image_id] = i;
  points_of_photo_.resize(photos_.size());
  std::map<Point3DId, const Point3D*> by_id;
  for (const auto& [id, point] : model.Points3D()) by_id[id] = &point;
  for (const auto& [id, point] : by_id) {
    points_.push_back({point->XYZ(), {}});
    for (const TrackElement& element : point->Track().Elements()) {
      const Image& image = model.Image(element.image_id);
      AddObservation(photo_of.at(element.image_id), image.Point2D(element.point2D_idx).XY());
    }
  }
}

void ModelPool::AddObservation(int photo, const Eigen::Vector2d& original) {
  std::vector<int>& of_photo = points_of_photo_[photo];
  const int point = static_cast<int>(points_.size()) - 1;
  if (!of_photo.empty() && of_photo.back() == point) return;
  const Undistortion& undistortion = undistortions_[photos_[photo].camera];
  const Eigen::Vector2d pixel = undistortion.Pixel(original);
  if (!IsInPhoto(undistortion.camera(), pixel)) {
    ++num_left_out_;
    return;
  }
  of_photo.push_back(point);
  points_.back().observations.push_back({photo, pixel});
}

bool ModelPool::HasParallax(const Eigen::Vector3d& xyz, const std::vector<int>& photos) const {
  std::vector<Eigen::Vector3d> rays;
  for (const int photo : photos) {
    rays.push_back((photos_[photo].cam_from_world.Centre() - xyz).normalized());
    for (const Eigen::Vector3d& other : rays) {
      if (rays.back().dot(other) < std::cos(kMinParallaxDeg * kRadian)) return true;
    }
  }
  return false;
}

bool ModelPool::Shows(int photo, const SurfaceSample& sample) const {
  Eigen::Vector2d pixel;
  return camera(photo).Project(this->photo(photo).cam_from_world.Apply(sample.xyz), &pixel);
}

PoolMap ModelPool::MapOf(const std::vector<int>& taken) const {
  PoolMap map = EmptyMapOf(taken);
  const std::vector<int> places = PlacesIn(taken);
  for (const Point& point : points_) {
    std::vector<int> observers;
    double error_px = 0;
    GuidedPoint guided{point.xyz, {}};
    for (const Observation& o : point.observations) {
      if (places[o.photo] < 0) continue;
      observers.push_back(o.photo);
      guided.photos.push_back(static_cast<uint32_t>(places[o.photo]));
      error_px += ErrorOf(o, point.xyz);
    }
    if (!HasParallax(point.xyz, observers)) continue;
    std::sort(guided.photos.begin(), guided.photos.end());
    map.map.points.push_back(std::move(guided));
    map.error_px.push_back(error_px / static_cast<double>(observers.size()));
  }
  return map;
}

// In pixels; infinite behind the camera.
double ModelPool::ErrorOf(const Observation& observation, const Eigen::Vector3d& xyz) const {
  const Eigen::Vector3d in_camera = photos_[observation.photo].cam_from_world.Apply(xyz);
  if (in_camera.z() <= 0) return std::numeric_limits<double>::infinity();
  const GuidedCamera& c = camera(observation.photo);
  const Eigen::Vector2d uv = in_camera.hnormalized();
  const Eigen::Vector2d pixel(c.fx_px * uv.x() + c.cx_px, c.fy_px * uv.y() + c.cy_px);
  return (pixel - observation.pixel).norm();
}

int ModelPool::CommonPoints(int photo, const std::vector<int>& taken) const {
  const std::vector<int> places = PlacesIn(taken);
  int common = 0;
  for (const int p : points_of_photo_[photo]) {
    std::vector<int> observers;
    for (const Observation& o : points_[p].observations) {
      if (places[o.photo] >= 0 && o.photo != photo) observers.push_back(o.photo);
    }
    common += HasParallax(points_[p].xyz, observers) ? 1 : 0;
  }
  return common;
}

}  // namespace skein
