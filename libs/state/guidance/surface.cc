#include "guidance/surface.h"

#include <limits>

#include "guidance/live_surface.h"

namespace skein {

Surfel Surfel::Gone() {
  Surfel surfel;
  surfel.position.setConstant(std::numeric_limits<double>::quiet_NaN());
  return surfel;
}

DetailedSurface MakeSurface(const GuidedMap& map) {
  DetailedSurface detailed;
  LiveSurface live({0}, &detailed.surface);
  live.Update(map);
  detailed.part_width = live.part_width();
  detailed.parts = live.parts();
  detailed.whole_of = live.whole_of();
  return detailed;
}

}  // namespace skein
