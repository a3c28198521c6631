#pragma once

#include <memory>
#include <vector>

#include "core/result.h"
#include "formats/formats.h"
#include "mapping/submap.h"
#include "skein/merge_t.hpp"

namespace skein {

// Outcome of absorbing a source.
struct Absorption {
  Status status;
  bool shows_another_place = false;              // why it failed: two visually similar places
  std::shared_ptr<const Reconstruction> before;  // the target as it was
  // Photos that are new in the target or, if it failed, that the target left to the source.
  std::vector<PhotoEvent> events;
};

// A merge, as the ledger orders it.
struct MergeTask {
  merge_t order;
  bool same_epochs = false;  // as in the order: both submaps kept their frames
  bool was_done = false;     // carried out again after a restart; not judged again
};

// Merges the source's model into the target's submap, which has the source's photos. Starts from
// the order's similarity, refined on what both submaps show now. If the order's similarity does not
// fit any more, it is estimated again with the order's options. A merge that was done never fails
// for want of a similarity. Worker's thread.
Absorption AbsorbSource(const ModelArchive& source, const MergeTask& task, Submap* submap);

// The same for a map of the same photos that was made here, without an order.
Absorption AbsorbBatch(const Submap& source, Submap* submap);

}  // namespace skein
