#pragma once

#include <string>
#include <vector>

#include "core/result.h"
#include "geometry/georeference.h"

namespace CLI {
class App;
}

namespace skein {

struct GuideOptions {
  // Ground sampling distance that is wanted, where the scale is known; 0: twice that of the median
  // point.
  double target_gsd_mm = 0;
  std::string altitude;  // "MIN:MAX", metres, as GPS tells them; "": as high as the agents' photos
  std::string no_go;     // file of polygons (ReadNoGo); "": none
  double work_share = 0.1;  // of the host's processor time, at most

  Status Check() const;
};

// [guide] of a config file.
void AddOptions(CLI::App& app, GuideOptions* options);

// Heights above the ellipsoid where an agent may stand, metres.
struct AltitudeRange {
  double min_m = 0, max_m = 0;
};
// "MIN:MAX"
Result<AltitudeRange> ParseAltitude(const std::string& text);

// A line "LATITUDE LONGITUDE" (WGS84, degrees) for each corner, an empty line between two polygons;
// what follows a # is no part of a line.
using NoGoAreas = std::vector<std::vector<GeodeticPosition>>;
Result<NoGoAreas> ParseNoGo(const std::string& text);
Result<NoGoAreas> ReadNoGo(const std::string& path);

}  // namespace skein
