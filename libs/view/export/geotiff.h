// Grids from above as GeoTIFF files.
#pragma once

#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "core/result.h"
#include "geometry/georeference.h"

namespace skein {

// Position of a grid in the plane of local_projection.h, in metres. Without an origin: in a level
// frame of the model, in its unit.
struct GridPlace {
  std::optional<GeodeticPosition> origin;
  double west = 0, north = 0;  // outer corner of the first cell
  double cell = 0;             // its side
};

// Rows go from north to south. `pixels`: CV_8UC4 (blue, green, red, alpha), CV_32FC1 (heights, NaN
// where nothing is known) or CV_8UC1 (shades, 0 where nothing is known). `metadata`: UTF-8, names
// and values as GDAL tells them.
//
// The layout is a cloud optimised GeoTIFF's (OGC 21-026): tiles, compressed without loss;
// overviews (overviews.h); all directories before the first tile; tiles of small overviews before
// those of large ones. Without an origin the file has no coordinate system, and a world file beside
// it, NAME.tfw, holds the place. A file appears when it is whole. Error: it cannot be written, or
// its pixels are of another type.
Status WriteGeoTiff(const cv::Mat& pixels, const GridPlace& place,
                    const std::map<std::string, std::string>& metadata,
                    const std::filesystem::path& file);

}  // namespace skein
