// Headers of photos: what ingest itself reads of them.
#include "fuzz/fuzz.h"
#include "photo/photo_check.h"

namespace skein::fuzz {

SKEIN_FUZZ_TARGET(photo_header) {
  const PhotoLimits limits;
  const auto header = CheckHeader(ByteView(data, size), limits);
  if (!header.ok()) return;
  Expect(header->width_px >= limits.min_side_px && header->height_px >= limits.min_side_px,
         "no side is too short");
  Expect(NumPixels(*header) <= static_cast<uint64_t>(limits.max_pixels), "not too large");
}

}  // namespace skein::fuzz
