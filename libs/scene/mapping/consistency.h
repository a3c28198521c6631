#pragma once

#include <vector>

#include "mapping/refusal.h"
#include "mapping/submap_options.h"
#include "mapping/waiting_photos.h"

namespace skein {

// Photos that should leave the map, and why.
struct Withdrawal {
  std::vector<ImageId> photos;
  Refusal refusal;
  bool of_similar_place = false;  // the photos show a visually similar place
};

// Finds photos that contradict the map; changes nothing.
class Consistency {
 public:
  // All must outlive this.
  Consistency(const SubmapOptions& options, const SceneMap& map, const WaitingPhotos& waiting)
      : options_(options), map_(map), waiting_(waiting) {}

  // A registered photo with fewer than kMinTie observations (model_check.h).
  bool IsWeak(ImageId id) const;

  // A registered photo that observes too few of the points of its matches, or whose matches agree
  // on another pose.
  struct Contradiction {
    bool exists = false;
    bool fits_elsewhere = false;
  };
  Contradiction FindContradiction(ImageId id) const;

  // Registered photos that fit their points better elsewhere (HasBetterPose). Costs a pose
  // estimation a photo.
  std::vector<ImageId> FindPhotosWithBetterPose() const;

  // Groups of photos in the wrong place: by matches that contradict their poses, else by different
  // cells, if a merge would keep the groups apart, else by missing cells. `first` is a photo of the
  // group that stays.
  Withdrawal FindMisplacedPhotos(ImageId first) const;
  // The part that fewer than kMinTie points tie to the rest (model_check.h). Visits all points.
  std::vector<ImageId> FindUntiedPhotos() const;
  // Registered photos that match a visually similar place and have too many missing cells. Such
  // photos may show that place: a cell can only differ where they have points of their own.
  std::vector<ImageId> FindPhotosWithTooManyMissingCells() const;

 private:
  // Whether a merge would join `photos` and the map's other photos: most pairs of photos across
  // show one place (ComparePlaces). Two spectral bands of one wall may have different cells in a
  // few pairs. Withdrawn, such photos would begin a map that is merged, and be withdrawn again.
  bool WouldBeMergedAgain(const std::vector<ImageId>& photos) const;
  std::vector<ImageId> FindByMissingCells(ImageId first) const;

  const SubmapOptions& options_;
  const SceneMap& map_;
  const WaitingPhotos& waiting_;
};

}  // namespace skein
