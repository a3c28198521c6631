#pragma once

#include <memory>
#include <string>
#include <vector>

#include "formats/formats.h"
#include "mapping/submap.h"
#include "skein/merge_t.hpp"

namespace skein {

// What absorbing came to.
struct Absorption {
  std::string reason;                                    // why not, or ""
  std::shared_ptr<const colmap::Reconstruction> before;  // the target as it was
  // Photos that are new in the target or, if it failed, that the target left to the source.
  std::vector<PhotoEvent> events;
};

// Merges the source's model into the target's submap, which has the source's photos. was_done: the
// ledger says that the merge is done, so it is not judged again. Worker's thread.
Absorption AbsorbSource(const ModelArchive& source, const merge_t& order, bool was_done,
                        Submap* submap);

}  // namespace skein
