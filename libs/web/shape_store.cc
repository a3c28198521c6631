#include "web/shape_store.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "map/model_io.h"
#include "map/shape_maker.h"
#include "web/events.h"

namespace skein {
namespace {

using nlohmann::json;

constexpr int kShapeDigits = 9;

int64_t BytesOf(const Shape& shape) {
  int64_t bytes = 0;
  for (const Shape::Chunk& chunk : shape.chunks) {
    bytes += static_cast<int64_t>(chunk.points->size());
    if (chunk.tracks != nullptr) bytes += static_cast<int64_t>(chunk.tracks->size());
  }
  return bytes;
}

}  // namespace

const Shape::Chunk* Shape::Find(uint64_t chunk_id) const {
  for (const Chunk& chunk : chunks) {
    if (chunk.id == chunk_id) return &chunk;
  }
  return nullptr;
}

bool ShapeStore::Set(ShapePtr shape) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto known = shapes_.find(shape->submap_id);
  if (known != shapes_.end() && known->second->version > shape->version) return false;
  int64_t bytes = BytesOf(*shape);
  for (const auto& [id, other] : shapes_) {
    if (id != shape->submap_id) bytes += BytesOf(*other);
  }
  if (bytes > kMaxBytes) return false;
  shapes_[shape->submap_id] = std::move(shape);
  return true;
}

void ShapeStore::Drop(int64_t submap_id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  shapes_.erase(submap_id);
}

ShapePtr ShapeStore::Find(int64_t submap_id) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = shapes_.find(submap_id);
  return found == shapes_.end() ? nullptr : found->second;
}

Result<ShapePtr> ShapeOfModel(int64_t submap_id, const std::string& model_blob,
                              const Bytes& archive, int64_t version) {
  const Result<ModelArchive> files = DecodeModelArchive(archive);
  if (!files.ok()) return files.status();
  const Result<colmap::Reconstruction> model = DecodeModel(*files);
  if (!model.ok()) return model.status();
  ShapeMaker maker;
  maker.Update(CopyForShape(*model), version);
  auto shape = std::make_shared<Shape>();
  shape->submap_id = submap_id;
  shape->version = static_cast<uint64_t>(version);
  shape->model_blob = model_blob;
  shape->photos = maker.shape().photos;
  shape->cameras = maker.shape().cameras;
  for (const auto& [id, chunk] : maker.shape().chunks) {
    shape->chunks.push_back(
        {id, chunk.version, chunk.num_points, chunk.points, chunk.tracks, "", 0});
  }
  return ShapePtr(shape);
}

std::string ShapeJson(const Shape& shape) {
  json photos = json::array(), chunks = json::array();
  json cameras = json::object();
  for (const ShapePhoto& photo : shape.photos) {
    json pose = json::array();
    for (const double value : photo.qvec) pose.push_back(Rounded(value, kShapeDigits));
    for (const double value : photo.tvec) pose.push_back(Rounded(value, kShapeDigits));
    photos.push_back(
        {{"image", photo.image_id}, {"camera", photo.camera_id}, {"pose", std::move(pose)}});
  }
  for (const ShapeCamera& camera : shape.cameras) {
    cameras[std::to_string(camera.camera_id)] = {{"width", camera.width},
                                                 {"height", camera.height},
                                                 {"fx", Rounded(camera.fx, kShapeDigits)},
                                                 {"fy", Rounded(camera.fy, kShapeDigits)},
                                                 {"cx", Rounded(camera.cx, kShapeDigits)},
                                                 {"cy", Rounded(camera.cy, kShapeDigits)}};
  }
  for (const Shape::Chunk& chunk : shape.chunks) {
    chunks.push_back({{"id", chunk.id}, {"version", chunk.version}, {"points", chunk.num_points}});
  }
  return json({{"submap", shape.submap_id},
               {"version", shape.version},
               {"utime_us", shape.version},
               {"photos", std::move(photos)},
               {"cameras", std::move(cameras)},
               {"chunks", std::move(chunks)}})
      .dump();
}

}  // namespace skein
