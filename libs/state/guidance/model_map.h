// A model as guidance reads it.
#pragma once

#include <cstddef>

#include "guidance/guided_map.h"
#include "sfm/reconstruction.h"

namespace skein {

// The registered photos and the points. If there are more than max_points points, every n-th is
// taken, in the order of their ids. Agents are not told apart.
GuidedMap MapOfModel(const Reconstruction& model, size_t max_points);

}  // namespace skein
