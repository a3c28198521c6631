// The ground from above: an elevation model and an orthophoto, from depth maps.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "depth/dense_points.h"
#include "depth/depth_map.h"

namespace skein {

// Cells of a level grid in a frame with x to the east, y to the north, z up. Rows go from north to
// south.
struct GroundGrid {
  double west = 0, north = 0;  // outer corner of the first cell
  double cell = 0;             // its side
  cv::Mat1f height;            // of the highest surface in a cell; NaN is a hole
  cv::Mat4b colour;            // blue, green, red, and alpha: 0 where no photo shows the surface

  bool IsHole(int row, int column) const;
  double Completeness() const;  // share of cells that have a colour
};

// A depth map with the colours of its pixels.
struct ColouredMap {
  const DepthMap* map;
  const cv::Mat3b* colours;
  const std::vector<DensePoint>* points;  // of PointsOf; nullptr where only the map matters
};

// Median over the maps of the surface that a pixel covers.
double GroundSamplingDistance(const std::vector<ColouredMap>& maps);

// A grid over the maps' points. `cell`: its side, made larger where it would have more than
// `most_cells`. A cell without points is a hole, but for gaps between samples: a hole with at
// least five of eight neighbours gets their mean. A cell's colour is a mean over the photos whose
// depth map shows it, weighted by (s cos a / g)^4. s: distance from the photo's border, a: angle
// from the vertical, g: ground sampling distance. So the best photo prevails, and seams are soft.
// Takes 29 bytes a cell. An empty grid without points.
GroundGrid MakeGroundGrid(const std::vector<ColouredMap>& maps, double cell,
                          double most_cells = 25e6);

}  // namespace skein
