// The cause of a refused georeference and its remedy, in words for a person.
#pragma once

#include <string>
#include <vector>

#include "geometry/georeference.h"

namespace skein {

// The georeference that some of the photos give by themselves.
using GeoreferenceOf = Georeference (*)(const GeodeticPosition& origin,
                                        const std::vector<const GeoPhoto*>& photos);

// Why `refused`, the georeference of `photos`, is not ok. The first cause that holds:
//  - Fewer than 5 latitudes and longitudes differ, as when a device keeps the start's.
//  - The positions of one agent are off those of another. The reference is the agent whose photos
//    place the map so that most agents agree, or most precisely (scale_sigma) among equals. The
//    agent with the largest median offset from the reference is named.
//  - sigma_m is larger than a GPS receiver's: the positions disagree with the map.
//  - Else `refused.reason`.
std::string CauseOfRefusal(const Georeference& refused, const std::vector<const GeoPhoto*>& photos,
                           GeoreferenceOf estimate);

}  // namespace skein
