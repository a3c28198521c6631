// The ground of a model from above, and its files.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "depth/ground_grid.h"
#include "depth/level_frame.h"
#include "geometry/georeference.h"

namespace skein {

struct Ground {
  GroundGrid grid;
  LevelFrame frame;                        // the model's own where `origin` is given
  std::optional<GeodeticPosition> origin;  // lengths are in metres; else in the model's unit

  std::string Up() const;            // where up comes from: "GPS", "ground plane" or "cameras"
  std::string HeightsAbove() const;  // where heights are 0
};

// `origin`: of a model in metres to the east, north and up of it; its altitude is added to heights.
// Without an origin the grid is in the frame of depth/level_frame.h. `cell`: side of a cell, at
// least. The grid is empty without points.
Ground MakeGround(const std::vector<ColouredMap>& maps,
                  const std::optional<GeodeticPosition>& origin, double cell);

// The content of orthophoto.json: unit, up, heights_above, cell, west, north, columns, rows,
// completeness, and level_from_model (x_level = rotation x_model + translation). ground_share is
// null with an origin.
nlohmann::json ToJson(const Ground& ground);

// orthophoto.tif, elevation.tif and hillshade.tif (export/geotiff.h), with world files where there
// is no origin, and orthophoto.json. `metadata`: for all GeoTIFFs, besides up and heights_above.
// Error: a file cannot be written.
Status WriteGround(const Ground& ground, std::map<std::string, std::string> metadata,
                   const std::filesystem::path& folder);

}  // namespace skein
