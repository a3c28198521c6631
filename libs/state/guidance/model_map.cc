#include "guidance/model_map.h"

#include <algorithm>
#include <map>
#include <vector>

#include "sfm/model_io.h"

namespace skein {
namespace {

GuidedCamera CameraOf(const Camera& camera) {
  const std::vector<size_t>& focal = camera.FocalLengthIdxs();
  return {static_cast<int>(camera.Width()), static_cast<int>(camera.Height()),
          camera.Params(focal.front()),     camera.Params(focal.back()),
          camera.PrincipalPointX(),         camera.PrincipalPointY()};
}

CameraPose PoseOf(const Image& image) {
  const Eigen::Vector4d& q = image.Qvec();
  CameraPose pose;
  pose.rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
  pose.translation = image.Tvec();
  return pose;
}

// By image id: where the photo is in the map.
std::map<ImageId, uint32_t> AddPhotos(const Reconstruction& model, GuidedMap* map) {
  std::map<CameraId, int32_t> cameras;
  std::vector<ImageId> ids = model.RegImageIds();
  std::sort(ids.begin(), ids.end());
  std::map<ImageId, uint32_t> index_of;
  for (const ImageId id : ids) {
    const Image& image = model.Image(id);
    const auto [camera, is_new] =
        cameras.try_emplace(image.CameraId(), static_cast<int32_t>(map->cameras.size()));
    if (is_new) map->cameras.push_back(CameraOf(model.Camera(image.CameraId())));
    index_of[id] = static_cast<uint32_t>(map->photos.size());
    map->photos.push_back({id, camera->second, 0, PoseOf(image)});
  }
  return index_of;
}

GuidedPoint PointOf(const Point3D& point, const std::map<ImageId, uint32_t>& index_of) {
  GuidedPoint guided;
  guided.xyz = point.XYZ();
  for (const TrackElement& element : point.Track().Elements()) {
    guided.photos.push_back(index_of.at(element.image_id));
  }
  std::sort(guided.photos.begin(), guided.photos.end());
  guided.photos.erase(std::unique(guided.photos.begin(), guided.photos.end()), guided.photos.end());
  return guided;
}

}  // namespace

GuidedMap MapOfModel(const Reconstruction& model, size_t max_points) {
  GuidedMap map;
  const std::map<ImageId, uint32_t> index_of = AddPhotos(model, &map);
  const std::vector<Point3DId> ids = AscendingPoints(model);
  const size_t step = (ids.size() + max_points - 1) / max_points;
  for (size_t i = 0; i < ids.size(); i += step) {
    map.points.push_back(PointOf(model.Point3D(ids[i]), index_of));
  }
  return map;
}

}  // namespace skein
