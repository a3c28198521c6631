#pragma once

#include <cstdint>
#include <memory>

#include "mapping/submap.h"

namespace skein {

// A submap of the same photos and matches, mapped again: all photos with verified pairs at once
// (global_map.h), then one by one those that could not be placed so.
//
// Photos that are not registered and match a visually similar place are left out, and those that
// other submaps hold, unless `takes_held`. A photo without the support that a growing map asks for
// stays out if photos are still to come, `is_growing` (supported_photos.h). `first` stays the first
// photo if it is registered. The map begins with the intrinsics that the submap found; if the
// submap does not explain its matches, and its photos share cameras, with those that these came
// with. Null if no map comes of it.
std::unique_ptr<Submap> MapAnew(const Submap& submap, ImageId first, bool takes_held,
                                bool is_growing);

// A submap of the same photos and matches that begins with the same model. The other photos are
// tried one by one, also those that other submaps hold. Null if the model does not fit.
std::unique_ptr<Submap> GrowToAll(const Submap& submap, ImageId first);

// Matches that agree with a map, and matches that another map could win.
struct MatchAgreement {
  int64_t agreeing = 0;  // matches between registered photos that are one point
  // Strong pairs between registered photos: their matches that agree, and all of them.
  int64_t strong_agreeing = 0, strong = 0;
  // Matches that another map of the same photos may agree with: those of strong pairs that are
  // torn (misplaced.h) by more than similar structures, and those of photos that are left out.
  // Photos that a visually similar place or another submap holds are left out rightly. If the map
  // does not explain its matches: all that don't agree.
  int64_t to_win = 0;
  int num_left_out = 0;  // strong pairs of which one photo is left out

  // Wrong intrinsics and short baselines let a map shrink to the few points that fit: the other
  // matches have no point, so they contradict nothing. Right maps explain half of their matches or
  // more.
  bool IsExplained() const { return 2 * strong_agreeing >= strong; }
};

// Whether another map may win enough of them to replace this one.
bool MayWinMatches(const SubmapOptions& options, const MatchAgreement& agreement);

// Visits all matches; means nothing where the options say stop.
MatchAgreement CountMatches(const SubmapOptions& options, const SceneMap& map,
                            const WaitingPhotos& waiting);

// A map of the same photos is absorbed, or taken for its smaller errors, if this part of the
// matches agrees with it. mamechun-room's had 0.99 and six photos more, one of photos and their
// mirror images had 0.51.
constexpr double kMinAgreeing = 0.9;

// A finished map, for the comparison with another one of the same photos.
struct MapErrors {
  int num_photos = 0;
  double reprojection_px = 0;  // mean of the observations
  double expected = 0;         // position error, as a fraction of the extent
  int64_t agreeing = 0;        // as in MatchAgreement

  // With no fewer photos and the smaller expected error, and the smaller reprojection error or more
  // matches that agree: a map that drops right matches of a photo at a false pose has the smaller
  // reprojection error.
  bool AreSmallerThan(const MapErrors& other) const;
};

}  // namespace skein
