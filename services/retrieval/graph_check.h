#pragma once

#include <cstddef>

#include "core/bytes.h"
#include "core/result.h"

namespace skein {

// Whether `saved`, as hnswlib saves a graph of vectors of `dim` values (int8_vector.h), may be
// loaded: hnswlib takes sizes, levels and links of a file for true and reads and writes where they
// lead. kDataLoss: they lead out of the graph, or a vector is none.
Status CheckGraph(const Bytes& saved, size_t dim);

}  // namespace skein
