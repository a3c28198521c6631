// A submap's shape for the page: of its newest model where no mapper tells one, and as JSON.
#pragma once

#include <cstdint>
#include <string>

#include "core/bytes.h"
#include "core/result.h"
#include "shapes/shape_store.h"

namespace skein {

// Of the newest model of a submap. `version`: of the shape.
Result<ShapePtr> ShapeOfModel(int64_t submap_id, const std::string& model_blob,
                              const Bytes& archive, int64_t version);

// /api/submaps/ID.
std::string ShapeJson(const Shape& shape);

}  // namespace skein
