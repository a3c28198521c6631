// A merge in the target's submap: compare with guests, find the similarity, absorb, check both.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/result.h"
#include "geometry/sim3_ransac.h"
#include "mapping/submap.h"
#include "merging/absorb.h"

namespace skein {

// A merge, as it was ordered.
struct MergeOrder {
  std::optional<Similarity> target_from_source;  // nullopt: none was found, e.g. of a batch
  int num_agreeing = 0;                          // photos that agreed with the similarity
  bool keeps_frames = false;                     // both submaps are in the frames of the similarity
  Sim3Options sim3;                              // with which it was estimated
  int min_shared_images = AbsorbOptions().min_shared_images;
  bool was_done = false;  // carried out again after a restart; not judged again
};

// Outcome of absorbing a source.
struct Absorption {
  Status status;
  bool shows_another_place = false;              // why it failed: two visually similar places
  std::shared_ptr<const Reconstruction> before;  // the target as it was; null if it failed
  // Photos that are new in the target or, if it failed, that the target left to the source.
  std::vector<PhotoEvent> events;
};

// Merges the source's model into the target's submap, which has the source's photos. The order's
// similarity is refined on the photos that both submaps show now. Only if the refined similarity
// does not hold, one is estimated from nothing, with the order's options. A similarity holds if all
// photos with enough common points agree with it, or as many as did at the order. A merge that was
// done never fails for want of a similarity. `source` may hold photos that are not registered. If
// the merge fails, the submap's photos stand as they did, but for those that it leaves to the
// source.
Absorption AbsorbIntoSubmap(const Reconstruction& source, const MergeOrder& order, Submap* submap);

// The same for a map of the same photos that was made here, without an order.
Absorption AbsorbBatch(const Submap& source, Submap* submap);

}  // namespace skein
