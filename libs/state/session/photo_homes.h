// Home of a photo: the submap that tries it. Every submap with a verified neighbour could try it,
// but each trial costs a bundle adjustment, and later ones tell little that the first did not. So a
// photo has one home. Several submaps of one place meet through the verified pairs between their
// photos.
//
// A submap holds its photos against others once it has three. An initial pair may be wrong, and
// must not keep its photos from a map that could take them.
//
// Pure functions of the ledger: mappers that have read as far agree.
#pragma once

#include <cstdint>
#include <map>

#include "session/session_state.h"

namespace skein {

// For each live submap that holds photos with which this one has a verified pair: the sum of the
// pairs' inliers. Costs the photo's pairs times the live submaps.
std::map<int64_t, int64_t> SupportOf(const SessionState& session, int64_t image_id);

constexpr int64_t kMinHolder = 3;  // photos

// A live submap other than `submap_id` that holds the photo against it; 0 if there is none.
int64_t HeldElsewhere(const SessionState& session, int64_t image_id, int64_t submap_id);

// A live submap that holds every photo of `submap_id`, and is larger, or the older of equals; 0 if
// there is none. Costs the submaps' photos.
int64_t HolderOfAll(const SessionState& session, int64_t submap_id);

// A live submap that is larger, or the older of equals, and supports a photo of `submap_id`
// (SupportOf); 0 if there is none. Costs SupportOf of each of its photos.
int64_t LargerNeighbour(const SessionState& session, int64_t submap_id);

// The submap that tries the photo next: most support (SupportOf) among those that have not refused
// the photo, the older of equals. 0 if a submap holds the photo, or none is left.
int64_t HomeOf(const SessionState& session, int64_t image_id);

}  // namespace skein
