#include "guidance/surface.h"

#include <limits>

#include "core/option_check.h"
#include "guidance/live_surface.h"

namespace skein {

Surfel Surfel::Gone() {
  Surfel surfel;
  surfel.position.setConstant(std::numeric_limits<double>::quiet_NaN());
  return surfel;
}

Status SurfaceOptions::Check() const {
  return FirstError({InRange("points_per_cell", points_per_cell, 0.1, 1000.0),
                     InRange("min_cell_px", min_cell_px, 1.0, 1000.0),
                     InRange("max_cell_share", max_cell_share, 0.001, 1.0),
                     InRange("max_incidence_deg", max_incidence_deg, 1.0, 90.0),
                     InRange("depth_tolerance", depth_tolerance, 0.0, 1.0)});
}

DetailedSurface MakeSurface(const SurfaceOptions& options, const GuidedMap& map) {
  DetailedSurface detailed;
  LiveSurface live(options, {0}, &detailed.surface);
  live.Update(map);
  detailed.part_width = live.part_width();
  detailed.parts = live.parts();
  detailed.whole_of = live.whole_of();
  return detailed;
}

}  // namespace skein
