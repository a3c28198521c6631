#include "web/page_shape.h"

#include <array>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "map/shape_maker.h"
#include "sfm/model_io.h"
#include "web/events.h"

namespace skein {
namespace {

using nlohmann::json;

constexpr int kShapeDigits = 9;
constexpr int kShareDigits = 4;

// cam_from_world: w, x, y, z of the rotation, then the translation.
json PoseJson(const std::array<double, 4>& qvec, const std::array<double, 3>& tvec) {
  json pose = json::array();
  for (const double value : qvec) pose.push_back(Rounded(value, kShapeDigits));
  for (const double value : tvec) pose.push_back(Rounded(value, kShapeDigits));
  return pose;
}

// Each form of the model is freed once the next one is made: together they are several times the
// shape.
Result<ShapeSource> SourceOfModel(Bytes archive) {
  Result<ModelArchive> files = DecodeModelArchive(archive);
  if (!files.ok()) return files.status();
  archive = Bytes();
  const Result<Reconstruction> model = DecodeModel(std::move(*files));
  if (!model.ok()) return model.status();
  return CopyForShape(*model);
}

}  // namespace

Result<ShapePtr> ShapeOfModel(int64_t submap_id, const std::string& model_blob, Bytes archive,
                              int64_t version) {
  Result<ShapeSource> source = SourceOfModel(std::move(archive));
  if (!source.ok()) return source.status();
  ShapeMaker maker;
  maker.Update(*source, version);
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
    photos.push_back({{"image", photo.image_id},
                      {"camera", photo.camera_id},
                      {"pose", PoseJson(photo.qvec, photo.tvec)}});
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

std::string DenseJson(int64_t submap_id, const DensePoints& points) {
  json photos = json::array();
  for (const DenseManifest::Photo& photo : points.manifest.photos) {
    json chunks = json::array();
    for (const DenseManifest::Chunk& chunk : photo.chunks) {
      chunks.push_back(
          {{"id", chunk.id}, {"version", chunk.version}, {"points", chunk.num_points}});
    }
    photos.push_back({{"image", photo.image_id},
                      {"scale", photo.scale},
                      {"share", Rounded(photo.share, kShareDigits)},
                      {"chunks", std::move(chunks)}});
  }
  return json({{"submap", submap_id}, {"version", points.version}, {"photos", std::move(photos)}})
      .dump();
}

std::string MeshJson(int64_t submap_id, const DensePoints& points) {
  const DenseManifest::Mesh& mesh = points.manifest.mesh;
  json frame = json::array(), chunks = json::array();
  for (const DenseManifest::Mesh::FramePhoto& photo : mesh.frame) {
    frame.push_back({{"image", photo.image_id}, {"pose", PoseJson(photo.qvec, photo.tvec)}});
  }
  for (const DenseManifest::Mesh::Chunk& chunk : mesh.chunks) {
    chunks.push_back(
        {{"id", chunk.id}, {"version", chunk.version}, {"triangles", chunk.num_triangles}});
  }
  return json({{"submap", submap_id},
               {"version", points.version},
               {"voxel", mesh.voxel},
               {"frame", std::move(frame)},
               {"chunks", std::move(chunks)}})
      .dump();
}

std::string DenseMessage(int64_t submap_id, const DensePoints& points) {
  return json({{"type", "dense"},
               {"submap", submap_id},
               {"version", points.version},
               {"photos", points.manifest.photos.size()},
               {"points", points.manifest.NumPoints()},
               {"triangles", points.manifest.NumTriangles()}})
      .dump();
}

std::string DenseGoneMessage(int64_t submap_id) {
  return json({{"type", "dense"}, {"submap", submap_id}, {"gone", true}}).dump();
}

std::string ShapeMessage(int64_t submap_id, uint64_t version) {
  return json({{"type", "shape"}, {"submap", submap_id}, {"version", version}}).dump();
}

std::string GoneMessage(int64_t submap_id) {
  return json({{"type", "shape"}, {"submap", submap_id}, {"gone", true}}).dump();
}

}  // namespace skein
