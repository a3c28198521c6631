// The ground from above: an elevation model and an orthophoto, from depth maps.
#pragma once

#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <vector>

#include "depth/coloured_map.h"

namespace skein {

// Cells of a grid in a level frame: x to the east, y to the north, z up. Rows go from north to
// south. Without GPS north is the frame's y (level_frame.h).
struct GroundGrid {
  double west = 0, north = 0;  // outer corner of the first cell
  double cell = 0;             // its side
  cv::Mat1f height;            // of the highest surface in a cell; NaN is a hole
  cv::Mat4b colour;            // blue, green, red, and alpha: 0 where no photo shows the surface

  bool IsHole(int row, int column) const;
  double Completeness() const;  // share of cells that have a colour
};

// A grid over the maps' points, in the frame that `level_from_model` leads to. `cell`: its side,
// made larger where it would have more than `most_cells`. A cell without points is a hole, but for
// gaps between samples: a hole with at least five of eight neighbours gets their mean.
//
// A cell has the colour of the photo that sees it best: the largest ViewScore, with the vertical as
// the normal. Seams are feathered: a photo with a share q > 0.8 of the largest score has the weight
// (q - 0.8) / 0.2 in a mean.
// Takes 33 bytes a cell. An empty grid without points.
GroundGrid MakeGroundGrid(const std::vector<ColouredMap>& maps,
                          const Eigen::Isometry3d& level_from_model, double cell,
                          double most_cells = 25e6);

}  // namespace skein
