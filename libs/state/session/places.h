// The places of a session: connected components of the verified pairs, with the maps of each. One
// place should become one map; where it has several, a finish maps it once more as a batch.
#pragma once

#include <cstdint>
#include <vector>

#include "session/session_state.h"

namespace skein {

struct Place {
  std::vector<int64_t> photos;   // through matching, ascending
  std::vector<int64_t> submaps;  // live ones with a photo of it, most photos first; older of equals
  // Left out, with its photos: a submap that a merge found to show another place, which looks like
  // the first submap's.
  bool IsDivided() const { return submaps.size() > 1; }
};

// Only pairs count that a photo can be registered by. Visits all photos and pairs.
std::vector<Place> FindPlaces(const SessionState& session);

// The place that the submap is the largest of, if it has others, too; null otherwise.
const Place* FindDividedPlace(const std::vector<Place>& places, int64_t largest_submap);

// Whether any place has several submaps; whether the submap's place does.
bool HasDividedPlace(const std::vector<Place>& places);
bool IsOfDividedPlace(const std::vector<Place>& places, int64_t submap_id);

}  // namespace skein
