// Viewpoints (stations) from which to photograph next.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "guidance/guided_map.h"
#include "guidance/quality.h"

namespace skein {

// Space in which an agent can stand.
struct Reach {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();  // unit; zero: as the photos tell (UpOf)
  // Heights along `up`, submap units; min > max: between those of the agent's own photos.
  double min_height = 1, max_height = 0;
  // Horizontal polygons to stay out of, in submap units: points of the map's frame, their heights
  // do not matter.
  std::vector<std::vector<Eigen::Vector3d>> no_go;
};

constexpr int kMaxStations = 5;            // of each agent: more are not told (advice_t)
constexpr double kMinStationPoints = 100;  // predicted, with the map

// A viewpoint: the pose of a photo to take, and why.
struct Station {
  CameraPose cam_from_world;
  Eigen::Vector3d target = Eigen::Vector3d::Zero();  // the weak place that it is for
  double gain = 0;             // area that becomes good or comes nearer to it, submap units squared
  double common_points = 0;    // predicted, with the map
  uint32_t nearest_photo = 0;  // index: start from where this was taken
  enum class Why : int8_t {
    kFewPhotos = 1,   // fewer than three photos see the place
    kNoParallax = 2,  // the photos are too close together
    kTooSlanted = 3,  // the photos look at the place too flatly, or in too different directions to
                      // match
    kTooFar = 4,      // too coarse for the target
    kOpenBorder = 5,  // the surface goes on where nobody has looked
  };
  Why why = Why::kFewPhotos;
};

// A failed photo: advised and taken, but not registered in the map.
struct VainPhoto {
  CameraPose cam_from_world;  // of its viewpoint
  double common_points = 0;   // that were predicted
};

// An agent that asks for viewpoints.
struct StationSeeker {
  int32_t agent = 0;        // its number in GuidedPhoto
  uint32_t last_photo = 0;  // where it is: index into GuidedMap::photos; its camera is used
  Reach reach;
  // Failed photos. If there are some, common points count only where the viewpoint sees them
  // through space that photos have looked through, as something may stand in the rest. Viewpoints
  // are chosen as if these photos had been taken, and none with HowFar < 0.2 from one. A failed
  // photo counts no more once twice as many common points are predicted at its pose.
  std::vector<VainPhoto> in_vain;
};

// For each agent its viewpoints, best first. A viewpoint is chosen as if those before it had been
// photographed, and agents take turns, so no two get the same. Empty where nothing is weak within
// reach. Deterministic. `min_common_points`: less than usual for a map of fewer points.
std::vector<std::vector<Station>> ChooseStations(const GuidedMap& map, const PlaceQuality& place,
                                                 const std::vector<StationSeeker>& seekers,
                                                 double min_common_points = kMinStationPoints);

}  // namespace skein
