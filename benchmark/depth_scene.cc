#include "benchmark/depth_scene.h"

#include <algorithm>
#include <map>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <stdexcept>

#include "export/session_models.h"
#include "sfm/reconstruction.h"

namespace skein {
namespace {

LensCamera LensOf(const Camera& camera) {
  LensCamera lens;
  lens.width = static_cast<int>(camera.Width());
  lens.height = static_cast<int>(camera.Height());
  lens.focal_px = {camera.FocalLengthX(), camera.FocalLengthY()};
  lens.principal_point_px = {camera.PrincipalPointX(), camera.PrincipalPointY()};
  const auto shared = std::make_shared<Camera>(camera);
  lens.project = [shared](const Eigen::Vector2d& ray) {
    return std::optional<Eigen::Vector2d>(shared->WorldToImage(ray));
  };
  return lens;
}

DepthPose PoseOf(const Image& image) { return {image.RotationMatrix(), image.Tvec()}; }

}  // namespace

DepthScene ReadDepthScene(const std::string& model) {
  const Result<ExportModel> read = ReadModelFolder(model);
  if (!read) throw std::runtime_error(read.error());
  const Reconstruction& reconstruction = *read->reconstruction;
  DepthScene scene;
  std::map<uint64_t, int> index_of_point;
  for (const auto& [id, point] : reconstruction.Points3D()) {
    index_of_point[id] = static_cast<int>(scene.points.size());
    scene.points.push_back(point.XYZ());
  }
  std::map<std::string, const Image*> by_name;
  for (const auto id : reconstruction.RegImageIds()) {
    const Image& image = reconstruction.Image(id);
    by_name[image.Name()] = &image;
  }
  for (const auto& [name, image] : by_name) {
    std::set<int> points;
    for (const Point2D& point : image->Points2D()) {
      if (point.HasPoint3D()) points.insert(index_of_point.at(point.Point3DId()));
    }
    scene.names.push_back(name);
    scene.lenses.push_back(LensOf(reconstruction.Camera(image->CameraId())));
    scene.cameras.push_back(static_cast<int>(image->CameraId()));
    scene.photos.push_back({PoseOf(*image), {points.begin(), points.end()}});
  }
  return scene;
}

cv::Mat1b ReadGreyPhoto(const std::string& folder, const std::string& name) {
  const cv::Mat1b photo =
      cv::imread(folder + "/" + name, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  if (photo.empty()) throw std::runtime_error(folder + "/" + name + " is no photo");
  return photo;
}

}  // namespace skein
