// A coarse surface from a map's points: oriented surfels, and which photos see each.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "guidance/guided_map.h"

namespace skein {

constexpr double kMaxSurfelIncidenceDeg = 75;  // a photo sees no surfel beyond it
// A surfel is hidden where another one is in front of it by more than this part of its distance.
constexpr double kDepthTolerance = 0.1;

// A piece of surface, as large as a cell.
struct Surfel {
  // Placeholder in LivePlace for a surfel that has gone: without points, photos and position.
  static Surfel Gone();
  bool IsGone() const { return num_points == 0; }

  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // mean of its points
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();    // unit, towards the photos that see it
  double area = 0;                                     // submap units squared
  uint32_t num_points = 0;
  // Photos that see the surfel, ascending indices into GuidedMap::photos: photos that observe a
  // point of it, and photos that have it in view with nothing in front.
  std::vector<uint32_t> photos;
  // At a frontier (open_border): the place to look at and the direction to look from; else the
  // surfel's own position and normal. A surface that was never photographed has no points: only
  // such a frontier tells of it. Beyond lies either more of the same surface, or another one around
  // the corner.
  Eigen::Vector3d beyond = Eigen::Vector3d::Zero();
  Eigen::Vector3d beyond_normal = Eigen::Vector3d::Zero();
  double beyond_max_deg = 0;  // a photo from further off that direction does not show it
  bool is_ground = false;     // faces up, and the photos look ahead
  bool at_end = false;        // the surface ends here
  bool open_border = false;   // a frontier: at_end, and less than two photos show what lies beyond
};

struct Surface {
  double cell = 0;              // width, submap units; 0: no surface
  double median_gsd = 0;        // submap units a pixel, of the median point in its nearest photo
  double working_distance = 0;  // median distance of a photo to the points that it observes
  std::vector<Surfel> surfels;
};

// A surface and what its surfels are made of.
struct DetailedSurface {
  Surface surface;
  std::vector<Surfel> parts;       // in cells as small as the points allow, without borders
  double part_width = 0;           // of such a cell
  std::vector<uint32_t> whole_of;  // of each part: the surfel that it is in, an index
};

// Empty for a map without points. Costs the number of observations, of surfels times photos, and
// of parts times the photos that have their surfel in view.
DetailedSurface MakeSurface(const GuidedMap& map);

}  // namespace skein
