// Guidance in plain words, for a person.
#pragma once

#include <Eigen/Core>
#include <string>

#include "geometry/sim3_similarity.h"
#include "guidance/stations.h"

namespace skein {

// How to say where something is.
struct Wording {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  double metres_per_unit = 0;   // 0: not known
  double working_distance = 1;  // submap units
};

// "2.1 m to the left from where alice/0031.jpg was taken, turned 20 degrees to the right: too few
// photos see this place". Left and forward as the photographer of that photo stood. Without a scale
// in parts of the distance to the object.
std::string StationSentence(const Wording& wording, const std::string& near_name,
                            const CameraPose& near, const Station& station);

}  // namespace skein
