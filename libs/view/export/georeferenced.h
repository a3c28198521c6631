// Models moved from their mapper's frame onto the earth.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "export/session_models.h"
#include "geometry/model_georeference.h"

namespace skein {

// Moves each model into metres to the east, north and up of one origin, which is that of all
// positions. Sets `georeference` of each. A model that cannot be placed is removed; `refusals` gets
// a line with the reason.
//
// If no photo carries an altitude, the models' heights are above their own cameras: the json says
// so (GeoreferenceToJson).
void PlaceOnEarth(const PhotoPositions& positions, std::vector<ExportModel>* models,
                  std::vector<std::string>* refusals);

// georeference.json into the folder; nothing for a model in its mapper's frame.
Status WriteGeoreference(const ExportModel& model, const std::filesystem::path& folder);

}  // namespace skein
