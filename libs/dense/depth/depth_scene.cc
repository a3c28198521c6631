#include "depth/depth_scene.h"

#include <map>
#include <memory>
#include <set>
#include <unordered_map>

namespace skein {

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

namespace {

DepthPose PoseOf(const Image& image) { return {image.RotationMatrix(), image.Tvec()}; }

}  // namespace

DepthScene DepthSceneOf(const Reconstruction& model) {
  DepthScene scene;
  std::unordered_map<Point3DId, int> index_of_point;
  for (const auto& [id, point] : model.Points3D()) {
    index_of_point[id] = static_cast<int>(scene.points.size());
    scene.points.push_back(point.XYZ());
  }
  std::map<std::string, const Image*> by_name;
  for (const ImageId id : model.RegImageIds()) by_name[model.Image(id).Name()] = &model.Image(id);
  for (const auto& [name, image] : by_name) {
    std::set<int> points;
    for (const Point2D& point : image->Points2D()) {
      if (point.HasPoint3D()) points.insert(index_of_point.at(point.Point3DId()));
    }
    scene.names.push_back(name);
    scene.lenses.push_back(LensOf(model.Camera(image->CameraId())));
    scene.cameras.push_back(static_cast<int>(image->CameraId()));
    scene.photos.push_back({PoseOf(*image), {points.begin(), points.end()}});
  }
  return scene;
}

}  // namespace skein
