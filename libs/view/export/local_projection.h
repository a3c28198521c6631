// The plane in which files on the earth have their coordinates.
#pragma once

#include <geotiff/geotiff.h>

#include "geometry/georeference.h"

namespace skein {

// GeoKeys of a transverse Mercator projection of WGS84 about `origin` (scale 1, no false easting):
// within 5 km it differs from metres to the east and north of the origin by less than 2 mm.
void SetLocalProjection(const GeodeticPosition& origin, GTIF* keys);

}  // namespace skein
