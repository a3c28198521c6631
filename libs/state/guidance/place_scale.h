// Lengths that all of a surface is measured by. Inside of libs/state/guidance.
#pragma once

#include <cstdint>
#include <vector>

#include "guidance/guided_map.h"

namespace skein {

struct PlaceScale {
  double median_gsd = 0;        // as Surface has it; 0: no surface
  double working_distance = 0;  // as Surface has it
  double cell = 0;              // width of a surfel's cell
  double part_cell = 0;         // width of a part's cell
};

// Number of observations of each photo.
std::vector<uint32_t> CountObservations(const GuidedMap& map);

// Medians of distances are over some 10,000 points, evenly spread over their order.
PlaceScale MeasureScale(const GuidedMap& map, const std::vector<uint32_t>& num_observations);

// Whether no length differs by more than this part of it.
bool IsWithin(double tolerance, const PlaceScale& a, const PlaceScale& b);

}  // namespace skein
