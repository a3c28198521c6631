#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "formats/texture_fields.h"
#include "geometry/georeference.h"
#include "ledger/session_folder.h"

namespace skein {

// By the name that the photo has in models, AGENT/NAME.
using PhotoPositions = std::map<std::string, GeodeticPosition>;

// Positions and texture of photos, from the ledger.
struct PlacePhotos {
  PhotoPositions positions;
  std::map<int64_t, TextureFields> textures;  // by image id
};

// Adds to each element of report["submaps"], of its model in sparse/:
//  - "georeference" (GeoreferenceToJson), all in ENU at one origin: that of all positions;
//  - "completeness" (PlaceJson): how much of the surface dense matching can reconstruct, with
//    target_gsd_mm millimetres a pixel where the scale is known, else twice the median point's.
// A model that cannot be read or placed has its reason. Reads each model whole.
void AddPlaces(const SessionPaths& paths, const PlacePhotos& photos, double target_gsd_mm,
               nlohmann::json* report);

}  // namespace skein
