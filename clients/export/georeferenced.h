// Models moved from their mapper's frame onto the earth.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "clients/export/session_models.h"
#include "geometry/georeference.h"

namespace skein {

// Moves each model into metres to the east, north and up of one origin, that of all positions, and
// notes how in its `georeference`. Models that cannot be placed are taken out; a line for each,
// with the reason, goes to `refusals`.
void PlaceOnEarth(const std::map<std::string, GeodeticPosition>& positions,
                  std::vector<ExportModel>* models, std::vector<std::string>* refusals);

}  // namespace skein
