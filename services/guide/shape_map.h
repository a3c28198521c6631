// A submap's shape as guidance reads it.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "core/result.h"
#include "guidance/guided_map.h"
#include "shapes/shape_store.h"

namespace skein {

struct ShapeMap {
  GuidedMap map;
  double share = 1;  // of the shape's points that are in it
};

// Points with who sees them: of a shape with tracks. Of more than max_points a part of each chunk
// is taken, which is a random one (map/shape_maker.h). Photos and points that make no sense (a
// camera without a focal length, a pose that is not finite) are left out. agent_of_image: numbers
// that tell agents apart; 0 for images that are not in it.
Result<ShapeMap> MapOfShape(const Shape& shape, const std::map<int64_t, int32_t>& agent_of_image,
                            int64_t max_points);

}  // namespace skein
