// Volume of a heap or a pit: between a surface, given by points, and a base plane.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace skein {

// Lengths are in the unit of the points.
struct PlaneVolume {
  double above = 0, below = 0;  // volumes on both sides of the base plane
  double area = 0;              // of the cells, in the base plane
  double filled = 0;            // share of `area` in cells without points
  double cell = 0;              // side of a cell
};

// `corners`: a closed polygon around the heap that does not cross itself, at least three. `up`:
// points to the side of the base plane that counts as above.
//
// Base plane: least squares through the corners and the points within a cell of the polygon's
// edges, of heights over the corners' mean plane. Cells are squares in the base plane that hold 8
// points in the mean. A cell counts if its centre is inside the polygon. Its height is the median
// of its points; a cell without points takes the mean of its neighbours, from the border of a hole
// inwards. web/src/volume.js measures in the same way. nullopt: the corners lie on a line, fewer
// than 8 points or no cell's centre inside.
std::optional<PlaneVolume> VolumeOverPlane(const std::vector<Eigen::Vector3d>& points,
                                           const std::vector<Eigen::Vector3d>& corners,
                                           const Eigen::Vector3d& up);

}  // namespace skein
