#pragma once

#include <set>
#include <vector>

#include "map/scene_map.h"
#include "mapping/adjuster.h"
#include "mapping/background_ba.h"

namespace skein {

// A map is at rest after so many seconds without a photo: a tenfold of its last global BA, and four
// at least. So photos that keep coming to a large map don't each call for adjustments of the whole.
double RestS(double last_global_ba_s);

// Work on the whole map beside registration, a bounded part at each call. First comes global BA in
// a thread of its own. Then all points are completed, merged and filtered, all pairs
// retriangulated, all images checked. The next BA may run during these phases.
class Maintenance {
 public:
  enum class Phase { kNone, kPoints, kPairs, kImages };

  // All must outlive this.
  Maintenance(const SubmapOptions& options, Adjuster* adjuster, SceneMap* map)
      : options_(options), adjuster_(*adjuster), map_(*map) {}

  // Registered images that the caller must look at after a part.
  struct ToCheck {
    std::vector<ImageId> weak;          // may have lost too many observations
    std::vector<ImageId> contradicted;  // may be contradicted by their matches
    bool all_checked = false;           // the last part of the last phase is done
    bool ba_began = false;              // a global BA of a map at rest
    bool ba_ended = false;              // a global BA is folded back
  };
  // `idle_s`: since the last photo came. After RestS a map that has grown by less gets its global
  // BA, too.
  ToCheck DoPart(double idle_s);
  bool HasWork() const;

  // A BA in the background, unless one runs or the points of the last one are not done.
  void StartGlobalBa();
  // A photo has come: at rest, global BAs are due again.
  void OnLocalBa();
  // A global BA was done in turn: its images are still to be looked at.
  void OnGlobalBa();
  // A photo left the map. If the photo comes back, it counts as new to the BA that runs.
  void OnWithdrawn(ImageId id);
  // Drops the BA and what follows it.
  void Drop();

 private:
  void FoldBackRefined(RefinedBundle* refined);
  void BeginPhases();
  ToCheck DoPoints();
  void DoPairs();
  ToCheck DoImages();

  const SubmapOptions& options_;
  Adjuster& adjuster_;
  SceneMap& map_;
  BackgroundBa background_;
  std::set<ImageId> withdrawn_;  // since it began
  int rounds_at_rest_ = 0;       // global BAs that a map at rest is still due
  Phase phase_ = Phase::kNone;
  // Remaining work of each phase.
  std::vector<Point3DId> points_;
  ImagePairs pairs_;
  std::vector<ImageId> images_;
};

}  // namespace skein
