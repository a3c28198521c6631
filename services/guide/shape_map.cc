#include "guide/shape_map.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>
#include <utility>
#include <vector>

namespace skein {
namespace {

constexpr double kMaxSidePx = 1e6;

bool IsSound(const ShapeCamera& camera) {
  const auto is_side = [](double side) { return side >= 1 && side <= kMaxSidePx; };
  const auto is_focal = [](double focal) { return std::isfinite(focal) && focal > 0; };
  return is_side(static_cast<double>(camera.width)) &&
         is_side(static_cast<double>(camera.height)) && is_focal(camera.fx) &&
         is_focal(camera.fy) && std::isfinite(camera.cx) && std::isfinite(camera.cy);
}

bool PoseOf(const ShapePhoto& photo, CameraPose* pose) {
  pose->rotation = Eigen::Quaterniond(photo.qvec[0], photo.qvec[1], photo.qvec[2], photo.qvec[3]);
  pose->translation = Eigen::Vector3d(photo.tvec[0], photo.tvec[1], photo.tvec[2]);
  const double norm = pose->rotation.norm();
  if (!std::isfinite(norm) || norm < 1e-6 || !pose->translation.allFinite()) return false;
  pose->rotation.normalize();
  return true;
}

// Photos by their ids: where they are in the map.
std::unordered_map<uint32_t, uint32_t> AddPhotos(const Shape& shape,
                                                 const std::map<int64_t, int32_t>& agent_of_image,
                                                 GuidedMap* map) {
  std::map<uint32_t, int32_t> cameras;
  for (const ShapeCamera& camera : shape.cameras) {
    if (!IsSound(camera)) continue;
    cameras[camera.camera_id] = static_cast<int32_t>(map->cameras.size());
    map->cameras.push_back({static_cast<int>(camera.width), static_cast<int>(camera.height),
                            camera.fx, camera.fy, camera.cx, camera.cy});
  }
  std::map<uint32_t, const ShapePhoto*> by_id;  // in the order they came
  for (const ShapePhoto& photo : shape.photos) by_id[photo.image_id] = &photo;
  std::unordered_map<uint32_t, uint32_t> index_of;
  for (const auto& [id, photo] : by_id) {
    const auto camera = cameras.find(photo->camera_id);
    CameraPose pose;
    if (camera == cameras.end() || !PoseOf(*photo, &pose)) continue;
    const auto agent = agent_of_image.find(id);
    index_of[id] = static_cast<uint32_t>(map->photos.size());
    map->photos.push_back(
        {id, camera->second, agent == agent_of_image.end() ? 0 : agent->second, pose});
  }
  return index_of;
}

void AddPoints(const ShapeChunk& chunk, const PointTracks& tracks, size_t count,
               const std::unordered_map<uint32_t, uint32_t>& index_of, GuidedMap* map) {
  for (size_t i = 0; i < count; ++i) {
    GuidedPoint point;
    for (int axis = 0; axis < 3; ++axis) {
      point.xyz[axis] = chunk.origin[axis] + chunk.step * chunk.points[i].xyz[axis];
    }
    if (!point.xyz.allFinite()) continue;
    for (uint32_t k = i == 0 ? 0 : tracks.ends[i - 1]; k < tracks.ends[i]; ++k) {
      const auto photo = index_of.find(tracks.observations[k].image_id);
      if (photo != index_of.end()) point.photos.push_back(photo->second);
    }
    std::sort(point.photos.begin(), point.photos.end());
    point.photos.erase(std::unique(point.photos.begin(), point.photos.end()), point.photos.end());
    if (!point.photos.empty()) map->points.push_back(std::move(point));
  }
}

}  // namespace

Result<ShapeMap> MapOfShape(const Shape& shape, const std::map<int64_t, int32_t>& agent_of_image,
                            int64_t max_points) {
  ShapeMap made;
  const std::unordered_map<uint32_t, uint32_t> index_of =
      AddPhotos(shape, agent_of_image, &made.map);
  int64_t num_points = 0;
  for (const Shape::Chunk& chunk : shape.chunks) num_points += chunk.num_points;
  if (num_points > max_points) {
    made.share = static_cast<double>(max_points) / static_cast<double>(num_points);
  }
  for (const Shape::Chunk& chunk : shape.chunks) {
    if (chunk.points == nullptr || chunk.tracks == nullptr) {
      return NotFound("chunk " + std::to_string(chunk.id) + " is not here");
    }
    const Result<ShapeChunk> points = DecodeShapeChunk(*chunk.points);
    if (!points.ok()) return points.status();
    const Result<PointTracks> tracks = DecodePointTracks(*chunk.tracks);
    if (!tracks.ok()) return tracks.status();
    if (tracks->ends.size() != points->points.size()) {
      return DataLoss("chunk " + std::to_string(chunk.id) + ": not the tracks of its points");
    }
    const auto count =
        static_cast<size_t>(std::ceil(made.share * static_cast<double>(points->points.size())));
    AddPoints(*points, *tracks, count, index_of, &made.map);
  }
  return made;
}

}  // namespace skein
