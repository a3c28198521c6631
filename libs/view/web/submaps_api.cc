#include "web/submaps_api.h"

#include <malloc.h>

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "core/log.h"
#include "formats/formats.h"
#include "formats/mesh_chunk.h"
#include "web/events.h"
#include "web/page_shape.h"

namespace skein {
namespace {

using nlohmann::json;

constexpr int kPointDigits = 9;

// A model is millions of small blocks, and what stays lies between them: glibc returns such memory
// to the kernel only when it is told to.
void ReturnFreedMemory() { ::malloc_trim(0); }

}  // namespace

SubmapsApi::SubmapsApi(const SessionView& view, const SessionSource& source, BlobFetcher& blobs)
    : view_(view), source_(source), blobs_(blobs) {}

void SubmapsApi::Handle(const PathParts& parts, const HttpRequest& request, Respond respond) {
  const std::optional<int64_t> id = ParseId(parts[1]);
  if (!id) return respond(HttpError(400, "a map is a number"));
  if (parts.size() >= 3 && parts[2] == "dense") return HandleDense(*id, parts, request, respond);
  if (parts.size() >= 3 && parts[2] == "mesh") return HandleMesh(*id, parts, request, respond);
  source_.on_look();
  WithShape(*id, respond, [this, parts, request, respond](const ShapePtr& shape) {
    if (parts.size() == 2) return respond(JsonResponse(ShapeJson(*shape)));
    if (parts[2] == "chunks" && parts.size() >= 4) {
      return GetChunk(*shape, parts, request, respond);
    }
    respond(HttpError(404, "there is no such path; /api/submaps/ID is one"));
  });
}

// A mapper's shape, where there is one; else that of the newest model.
void SubmapsApi::WithShape(int64_t submap_id, const Respond& respond,
                           std::function<void(ShapePtr)> then) {
  struct Model {
    bool known = false, ended = false;
    int64_t merged_into = 0;
    std::string blob;
    int64_t utime_us = 0;
  };
  const Model model = view_.With([&](const SessionRecord& session) {
    const SubmapLife* submap = session.state.FindSubmap(submap_id);
    if (submap == nullptr) return Model();
    Model found{true, submap->ended, submap->merged_into, "", 0};
    if (submap->latest_model) {
      found.blob = submap->latest_model->model_blob;
      found.utime_us = submap->latest_model->header.utime_us;
    }
    return found;
  });
  const std::string name = "map " + std::to_string(submap_id);
  if (!model.known) return respond(NoSuch(name));
  if (model.ended) {
    return respond(HttpError(
        404, name + " has ended" +
                 (model.merged_into == 0
                      ? ""
                      : "; map " + std::to_string(model.merged_into) + " has its photos")));
  }
  const ShapePtr shape = shapes_.Find(submap_id);
  const bool is_current =
      shape != nullptr &&
      (shape->model_blob == model.blob || shape->version >= static_cast<uint64_t>(model.utime_us) ||
       !source_.may_use_model(submap_id));
  if (is_current) return then(shape);
  if (model.blob.empty() || !source_.may_use_model(submap_id)) {
    return respond(HttpError(404, name + " has no shape yet: ask again"));
  }
  blobs_.FetchAll({model.blob}, "ingest", respond,
                  [this, submap_id, model, respond, then](BlobFetcher::Blobs blobs) {
                    const Result<ShapePtr> made = MakeShape(
                        submap_id, model.blob, std::move(blobs.at(model.blob)), model.utime_us);
                    if (!made.ok()) return AnswerError(respond, made.status());
                    then(*made);
                  });
}

// One at a time: two would take twice the memory.
Result<ShapePtr> SubmapsApi::MakeShape(int64_t submap_id, const std::string& model_blob,
                                       Bytes archive, int64_t version) {
  const std::lock_guard<std::mutex> lock(making_);
  const ShapePtr known = shapes_.Find(submap_id);
  if (known != nullptr && known->model_blob == model_blob) return known;
  Result<ShapePtr> made = ShapeOfModel(submap_id, model_blob, std::move(archive), version);
  ReturnFreedMemory();
  if (made.ok() && !shapes_.Set(*made)) LogWarn("submap {}: no room for its shape", submap_id);
  return made;
}

// Answers, and returns false, unless the request asks for the version that there is.
bool SubmapsApi::IsVersion(uint64_t version, const HttpRequest& request, const Respond& respond) {
  const auto given = request.query.find("v");
  const std::optional<int64_t> wanted =
      given == request.query.end() ? std::nullopt : ParseId(given->second);
  if (!wanted) {
    respond(HttpError(400, "v: give the chunk's version"));
    return false;
  }
  if (static_cast<uint64_t>(*wanted) == version) return true;
  HttpResponse gone;
  gone.status = 404;
  gone.text =
      json({{"error", "this version is gone: take the newest one"}, {"version", version}}).dump();
  respond(std::move(gone));
  return false;
}

void SubmapsApi::AnswerChunk(std::shared_ptr<const Bytes> points, const Respond& respond) {
  HttpResponse response = BytesResponse(std::move(points), "application/octet-stream");
  response.immutable = true;
  response.ranges = true;
  respond(std::move(response));
}

void SubmapsApi::HandleDense(int64_t submap_id, const PathParts& parts, const HttpRequest& request,
                             const Respond& respond) {
  const DensePointsPtr points = dense_.Find(submap_id);
  if (points == nullptr) {
    return respond(NoSuch("dense points of map " + std::to_string(submap_id) + " yet"));
  }
  if (parts.size() == 3) return respond(JsonResponse(DenseJson(submap_id, *points)));
  const std::optional<int64_t> id = parts.size() == 4 ? ParseId(parts[3]) : std::nullopt;
  const auto* chunk = id ? points->Find(static_cast<uint64_t>(*id)) : nullptr;
  if (chunk == nullptr) return respond(NoSuch("such chunk of the newest dense points"));
  if (!IsVersion(chunk->version, request, respond)) return;
  AnswerBlob(chunk->points_blob, points->owner,
             kShapeChunkHeaderBytes + kShapePointBytes * chunk->num_points, respond);
}

void SubmapsApi::HandleMesh(int64_t submap_id, const PathParts& parts, const HttpRequest& request,
                            const Respond& respond) {
  const DensePointsPtr points = dense_.Find(submap_id);
  if (points == nullptr || points->manifest.mesh.chunks.empty()) {
    return respond(NoSuch("mesh of map " + std::to_string(submap_id) + " yet"));
  }
  if (parts.size() == 3) return respond(JsonResponse(MeshJson(submap_id, *points)));
  const std::optional<int64_t> id = parts.size() == 4 ? ParseId(parts[3]) : std::nullopt;
  const auto* chunk = id ? points->FindMeshChunk(static_cast<uint64_t>(*id)) : nullptr;
  if (chunk == nullptr) return respond(NoSuch("such chunk of the newest mesh"));
  if (!IsVersion(chunk->version, request, respond)) return;
  AnswerBlob(chunk->blob, points->owner, MeshChunkBytes(chunk->num_vertices, chunk->num_triangles),
             respond);
}

// A chunk of another size is refused.
void SubmapsApi::AnswerBlob(const std::string& blob_id, const std::string& owner, size_t num_bytes,
                            const Respond& respond) {
  blobs_.FetchAll({blob_id}, owner, respond, [respond, num_bytes](BlobFetcher::Blobs blobs) {
    Bytes& bytes = blobs.begin()->second;
    if (bytes.size() != num_bytes) {
      return AnswerError(respond, DataLoss("not a chunk of that size"));
    }
    AnswerChunk(std::make_shared<const Bytes>(std::move(bytes)), respond);
  });
}

void SubmapsApi::GetChunk(const Shape& shape, const PathParts& parts, const HttpRequest& request,
                          Respond respond) {
  const std::optional<int64_t> id = ParseId(parts[3]);
  const Shape::Chunk* chunk = id ? shape.Find(static_cast<uint64_t>(*id)) : nullptr;
  if (chunk == nullptr) return respond(NoSuch("such chunk in the newest shape"));
  if (!IsVersion(chunk->version, request, respond)) return;
  if (parts.size() == 4) return AnswerChunk(chunk->points, respond);
  const std::optional<int64_t> index = parts.size() == 6 ? ParseId(parts[5]) : std::nullopt;
  if (parts[4] != "points" || !index) {
    return respond(HttpError(404, "there is no such path; points/INDEX of a chunk is one"));
  }
  GetPoint(*chunk, shape.owner, *index, respond);
}

void SubmapsApi::GetPoint(const Shape::Chunk& chunk, const std::string& owner, int64_t index,
                          Respond respond) {
  if (index >= static_cast<int64_t>(chunk.num_points)) {
    return respond(NoSuch("point " + std::to_string(index) + " in this chunk"));
  }
  if (chunk.tracks != nullptr) return AnswerPoint(chunk, *chunk.tracks, index, respond);
  blobs_.FetchAll({chunk.tracks_blob}, owner, respond,
                  [this, chunk, index, respond](const BlobFetcher::Blobs& blobs) {
                    AnswerPoint(chunk, blobs.begin()->second, index, respond);
                  });
}

void SubmapsApi::AnswerPoint(const Shape::Chunk& chunk, const Bytes& tracks_bytes, int64_t index,
                             Respond respond) {
  const Result<ShapeChunk> points = DecodeShapeChunk(*chunk.points);
  const Result<PointTracks> tracks = DecodePointTracks(tracks_bytes);
  if (!points.ok()) return AnswerError(respond, points.status());
  if (!tracks.ok()) return AnswerError(respond, tracks.status());
  const auto at = static_cast<size_t>(index);
  if (at >= points->points.size() || at >= tracks->ends.size()) {
    return respond(HttpError(500, "the chunk's parts do not fit together"));
  }
  json xyz = json::array();
  for (int i = 0; i < 3; ++i) {
    xyz.push_back(
        Rounded(points->origin[i] + points->step * points->points[at].xyz[i], kPointDigits));
  }
  const std::vector<PointObservation> seen(
      tracks->observations.begin() + (at == 0 ? 0 : tracks->ends[at - 1]),
      tracks->observations.begin() + tracks->ends[at]);
  std::map<uint32_t, std::string> keypoint_blobs;
  view_.With([&](const SessionRecord& session) {
    for (const PointObservation& observation : seen) {
      const PhotoState* photo = session.state.FindPhoto(observation.image_id);
      if (photo != nullptr && photo->features_seq > 0) {
        keypoint_blobs[observation.image_id] = photo->features.keypoints_blob;
      }
    }
    return true;
  });
  std::vector<std::string> wanted;
  for (const auto& [id, blob] : keypoint_blobs) wanted.push_back(blob);
  if (wanted.empty()) {
    return respond(JsonResponse(json({{"xyz", xyz}, {"photos", json::array()}}).dump()));
  }
  blobs_.FetchAll(wanted, "ingest", respond, [=](const BlobFetcher::Blobs& blobs) {
    json photos = json::array();
    for (const PointObservation& observation : seen) {
      const auto blob = keypoint_blobs.find(observation.image_id);
      if (blob == keypoint_blobs.end()) continue;
      const Result<Keypoints> keypoints = DecodeKeypoints(blobs.at(blob->second));
      if (!keypoints.ok()) return AnswerError(respond, keypoints.status());
      if (observation.point2D_idx >= keypoints->size()) continue;
      const Keypoint& keypoint = (*keypoints)[observation.point2D_idx];
      photos.push_back({{"image", observation.image_id},
                        {"x", Rounded(keypoint.x, kPixelDigits)},
                        {"y", Rounded(keypoint.y, kPixelDigits)}});
    }
    respond(JsonResponse(json({{"xyz", xyz}, {"photos", std::move(photos)}}).dump()));
  });
}

}  // namespace skein
