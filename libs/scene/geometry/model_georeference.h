// A model's photos and their GPS positions, for EstimateGeoreference.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "geometry/georeference.h"
#include "sfm/reconstruction.h"

namespace skein {

// Positions of photos, by the name that a photo has in models: AGENT/NAME.
using PhotoPositions = std::map<std::string, GeodeticPosition>;

// EnuOrigin of all positions.
GeodeticPosition OriginOfPhotos(const PhotoPositions& positions);

// The registered photos that carry a position, in the order of their ids.
std::vector<GeoPhoto> PhotosWithPosition(const Reconstruction& model,
                                         const PhotoPositions& positions);

}  // namespace skein
