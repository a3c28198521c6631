#pragma once

#include <cstdint>

namespace skein {

// Which submap a run has, and in which epoch of it.
struct Lease {
  int64_t submap_id = 0;
  int64_t epoch = 0;
};

}  // namespace skein
