// Whole photos through the codecs, as skein-decoder runs them. Small ones, for speed.
#include "codecs/check_photo.h"
#include "codecs/image_decoding.h"
#include "fuzz/fuzz.h"

namespace skein::fuzz {

SKEIN_FUZZ_TARGET(decoding) {
  PhotoLimits limits;
  limits.max_pixels = 100'000;
  limits.min_side_px = 1;
  const ByteView photo(data, size);
  const auto checked = CheckPhoto(photo, limits);
  const auto image = DecodePhoto(photo, limits.max_pixels);
  if (!checked.ok()) return;
  Expect(image.ok(), "what ingest takes can be decoded");
  Expect(image->cols == checked->header.width_px && image->rows == checked->header.height_px,
         "and has the size in its header");
}

}  // namespace skein::fuzz
