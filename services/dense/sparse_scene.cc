#include "dense/sparse_scene.h"

#include <cmath>
#include <optional>
#include <string>
#include <utility>

namespace skein {
namespace {

std::optional<Camera> SoundCamera(const ShapeCamera& shape) {
  if (!IsCameraSide(shape.width) || !IsCameraSide(shape.height) ||
      !AreParamsOfModel(shape.model_id, shape.params)) {
    return std::nullopt;
  }
  for (const double value : shape.params) {
    if (!std::isfinite(value)) return std::nullopt;
  }
  Camera camera;
  camera.SetCameraId(shape.camera_id);
  camera.SetModelId(shape.model_id);
  camera.SetWidth(shape.width);
  camera.SetHeight(shape.height);
  camera.SetParams(shape.params);
  const bool has_focal = camera.FocalLengthX() > 0 && camera.FocalLengthY() > 0;
  return has_focal ? std::optional(camera) : std::nullopt;
}

DepthPose PoseOf(const ShapePhoto& photo) {
  const Eigen::Quaterniond rotation(photo.qvec[0], photo.qvec[1], photo.qvec[2], photo.qvec[3]);
  return {rotation.normalized().toRotationMatrix(), Eigen::Vector3d::Map(photo.tvec.data())};
}

}  // namespace

Status SparseScene::Update(const Shape& shape) {
  TakePhotos(shape);
  Status taken = TakeChunks(shape);
  if (taken.ok()) {
    TakePoints();
  } else {
    *this = SparseScene();
  }
  return taken;
}

int SparseScene::Find(uint32_t image_id) const {
  const auto index = index_of_.find(image_id);
  return index == index_of_.end() ? -1 : index->second;
}

void SparseScene::TakePhotos(const Shape& shape) {
  cameras_.clear();
  for (const ShapeCamera& camera : shape.cameras) {
    if (auto sound = SoundCamera(camera)) cameras_[camera.camera_id] = *std::move(sound);
  }
  std::map<uint32_t, std::pair<uint32_t, DepthPose>> by_id;
  for (const ShapePhoto& photo : shape.photos) {
    if (HasPose(photo) && cameras_.count(photo.camera_id) > 0) {
      by_id[photo.image_id] = {photo.camera_id, PoseOf(photo)};
    }
  }
  image_ids_.clear();
  camera_ids_.clear();
  photos_.clear();
  index_of_.clear();
  for (const auto& [id, photo] : by_id) {
    index_of_[id] = static_cast<int>(photos_.size());
    image_ids_.push_back(id);
    camera_ids_.push_back(photo.first);
    photos_.push_back({photo.second, {}});
  }
}

Status SparseScene::TakeChunks(const Shape& shape) {
  std::map<uint64_t, Chunk> before = std::move(chunks_);
  chunks_.clear();
  for (const Shape::Chunk& shaped : shape.chunks) {
    const std::string name = "chunk " + std::to_string(shaped.id);
    if (shaped.points == nullptr || shaped.tracks == nullptr)
      return NotFound(name + " is not here");
    const auto known = before.find(shaped.id);
    if (known != before.end() && known->second.version == shaped.version) {
      chunks_[shaped.id] = std::move(known->second);
      continue;
    }
    const Result<ShapeChunk> points = DecodeShapeChunk(*shaped.points);
    if (!points.ok()) return points.status().Within(name);
    Result<PointTracks> tracks = DecodePointTracks(*shaped.tracks);
    if (!tracks.ok()) return tracks.status().Within(name);
    if (tracks->ends.size() != points->points.size()) {
      return DataLoss(name + ": not the tracks of its points");
    }
    Chunk chunk;
    chunk.version = shaped.version;
    chunk.tracks = *std::move(tracks);
    for (const ShapePoint& point : points->points) {
      const Eigen::Vector3d steps(point.xyz[0], point.xyz[1], point.xyz[2]);
      chunk.points.push_back(Eigen::Vector3d::Map(points->origin.data()) + points->step * steps);
    }
    chunks_[shaped.id] = std::move(chunk);
  }
  return Status::Ok();
}

// The photos' lists are ascending, as points come by their indices.
void SparseScene::TakePoints() {
  points_.clear();
  for (const auto& [id, chunk] : chunks_) {
    uint32_t begin = 0;
    for (size_t i = 0; i < chunk.points.size(); ++i) {
      const uint32_t end = chunk.tracks.ends[i];
      if (chunk.points[i].allFinite()) {
        const int index = static_cast<int>(points_.size());
        points_.push_back(chunk.points[i]);
        for (uint32_t k = begin; k < end; ++k) {
          const int photo = Find(chunk.tracks.observations[k].image_id);
          if (photo < 0) continue;
          std::vector<int>& seen = photos_[photo].points;
          if (seen.empty() || seen.back() != index) seen.push_back(index);
        }
      }
      begin = end;
    }
  }
}

}  // namespace skein
