#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "geometry/georeference.h"
#include "ledger/session_folder.h"

namespace skein {

// By the name that the photo has in models, AGENT/NAME.
using PhotoPositions = std::map<std::string, GeodeticPosition>;

// Adds to each element of report["submaps"] the georeference of its model in sparse/
// (GeoreferenceToJson), all in ENU at one origin: that of all positions. A model that cannot be
// read or placed has its reason.
void AddGeoreferences(const SessionPaths& paths, const PhotoPositions& positions,
                      nlohmann::json* report);

}  // namespace skein
