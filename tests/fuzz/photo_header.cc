// Headers of photos: what ingest itself reads of them.
#include "fuzz/fuzz.h"
#include "photo/photo_check.h"

using namespace skein;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const PhotoLimits limits;
  const auto header = CheckHeader(ByteView(data, size), limits);
  if (!header.ok()) return 0;
  fuzz::Expect(header->width_px >= limits.min_side_px && header->height_px >= limits.min_side_px,
               "no side is too short");
  fuzz::Expect(NumPixels(*header) <= static_cast<uint64_t>(limits.max_pixels), "not too large");
  return 0;
}
