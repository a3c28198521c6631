// Map snapshot (shape) of a submap for the page: made of its newest model if no mapper publishes
// one, as JSON, and the messages that tell pages of it.
#pragma once

#include <cstdint>
#include <string>

#include "core/bytes.h"
#include "core/result.h"
#include "shapes/dense_store.h"
#include "shapes/shape_store.h"

namespace skein {

// Map snapshot (shape) of a submap's newest model. `version`: of the shape.
Result<ShapePtr> ShapeOfModel(int64_t submap_id, const std::string& model_blob, Bytes archive,
                              int64_t version);

// /api/submaps/ID.
std::string ShapeJson(const Shape& shape);

// /api/submaps/ID/dense.
std::string DenseJson(int64_t submap_id, const DensePoints& points);
// /api/submaps/ID/mesh.
std::string MeshJson(int64_t submap_id, const DensePoints& points);

// The messages that tell all pages of a submap's dense points, or that it has none any more.
std::string DenseMessage(int64_t submap_id, const DensePoints& points);
std::string DenseGoneMessage(int64_t submap_id);

// The messages that tell all pages the version of a shape, or that a submap has none any more.
std::string ShapeMessage(int64_t submap_id, uint64_t version);
std::string GoneMessage(int64_t submap_id);

}  // namespace skein
