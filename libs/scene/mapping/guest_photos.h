#pragma once

#include <deque>

#include "mapping/photo_trial.h"

namespace skein {

// Photos of another submap that stand in this map for as long as the two are compared. The
// destructor restores the map as it was; no other code may change the map meanwhile.
class GuestPhotos {
 public:
  // `map` must outlive this.
  explicit GuestPhotos(SceneMap* map) : map_(*map) {}
  ~GuestPhotos();
  GuestPhotos(const GuestPhotos&) = delete;
  GuestPhotos& operator=(const GuestPhotos&) = delete;

  // No effect where the photo's trial fails. `found`: poses of the comparison before; null: none.
  void Place(ImageId id, const TrialContext& context, FoundPoses* found = nullptr);
  int size() const { return static_cast<int>(trials_.size()); }

 private:
  SceneMap& map_;
  std::deque<PhotoTrial> trials_;  // of those that stand, in order
};

}  // namespace skein
