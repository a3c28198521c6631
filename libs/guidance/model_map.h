// A COLMAP model as guidance reads it.
#pragma once

#include <cstddef>

#include "base/reconstruction.h"
#include "guidance/guided_map.h"

namespace skein {

// The registered photos and the points. Of more than max_points every n-th is taken, in the order
// of their ids. Agents are not told apart.
GuidedMap MapOfModel(const colmap::Reconstruction& model, size_t max_points);

}  // namespace skein
