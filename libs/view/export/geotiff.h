// Grids on the earth as GeoTIFF files.
#pragma once

#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <string>

#include "core/result.h"
#include "geometry/georeference.h"

namespace skein {

// Position of a grid in the plane of local_projection.h.
struct GridPlace {
  GeodeticPosition origin;
  double west_m = 0, north_m = 0;  // outer corner of the first cell
  double cell_m = 0;
};

// Rows go from north to south. `pixels`: CV_8UC4 (blue, green, red, alpha) or CV_32FC1 (NaN where
// nothing is known). `metadata`: UTF-8, names and values as GDAL tells them. Tiled, compressed
// without loss. The file appears when it is whole. Error: it cannot be written, or its pixels are
// of another type.
Status WriteGeoTiff(const cv::Mat& pixels, const GridPlace& place,
                    const std::map<std::string, std::string>& metadata,
                    const std::filesystem::path& file);

}  // namespace skein
