// /api/submaps: map snapshots (shapes), their chunks, the photos that see a point, dense points,
// and meshes.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>

#include "core/bytes.h"
#include "core/result.h"
#include "http/http.h"
#include "shapes/dense_store.h"
#include "shapes/shape_store.h"
#include "web/api_answers.h"
#include "web/blob_fetcher.h"
#include "web/session_source.h"
#include "web/session_view.h"

namespace skein {

// Any thread.
class SubmapsApi {
 public:
  // All outlive this.
  SubmapsApi(const SessionView& view, const SessionSource& source, BlobFetcher& blobs);

  ShapeStore& shapes() { return shapes_; }
  DenseStore& dense() { return dense_; }

  // `parts`: {"submaps", ID, ...}.
  void Handle(const PathParts& parts, const HttpRequest& request, Respond respond);

 private:
  void WithShape(int64_t submap_id, const Respond& respond, std::function<void(ShapePtr)> then);
  // Map snapshot (shape) of a submap's newest model.
  Result<ShapePtr> MakeShape(int64_t submap_id, const std::string& model_blob, Bytes archive,
                             int64_t version);
  void HandleDense(int64_t submap_id, const PathParts& parts, const HttpRequest& request,
                   const Respond& respond);
  void HandleMesh(int64_t submap_id, const PathParts& parts, const HttpRequest& request,
                  const Respond& respond);
  void AnswerBlob(const std::string& blob_id, const std::string& owner, size_t num_bytes,
                  const Respond& respond);
  void GetChunk(const Shape& shape, const PathParts& parts, const HttpRequest& request,
                Respond respond);
  static bool IsVersion(uint64_t version, const HttpRequest& request, const Respond& respond);
  static void AnswerChunk(std::shared_ptr<const Bytes> points, const Respond& respond);
  void GetPoint(const Shape::Chunk& chunk, const std::string& owner, int64_t index,
                Respond respond);
  void AnswerPoint(const Shape::Chunk& chunk, const Bytes& tracks, int64_t index, Respond respond);

  const SessionView& view_;
  const SessionSource& source_;
  BlobFetcher& blobs_;
  ShapeStore shapes_;
  DenseStore dense_;
  std::mutex making_;
};

}  // namespace skein
