#pragma once

#include <cstdint>

namespace skein {

// Submap of a run, and the epoch of its lease.
struct Lease {
  int64_t submap_id = 0;
  int64_t epoch = 0;
};

}  // namespace skein
