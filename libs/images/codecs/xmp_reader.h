#pragma once

#include <optional>

#include "photo/byte_view.h"
#include "photo/photo_header.h"

namespace skein {

// Position of a DJI drone, in the namespace "http://www.dji.com/drone-dji/1.0/".
struct DronePosition {
  std::optional<double> latitude_deg, longitude_deg;  // WGS84
  std::optional<double> altitude_m;                   // AbsoluteAltitude
  std::optional<double> relative_altitude_m;          // RelativeAltitude: above the take-off
};

// From the XMP packet of a JPEG (APP1, Adobe's XMP specification part 3, section 1.1.3) or of a
// TIFF (tag 700); a PNG's is not read. A property may be an attribute or an element (part 1,
// section 7). A property that is absent, no number, out of range, or 0, 0 (no fix) is unset. Reads
// no document type, so no entity expands.
DronePosition ReadDronePosition(ByteView photo, PhotoFormat format);

}  // namespace skein
