#pragma once

#include "core/bytes.h"
#include "core/result.h"
#include "photo/photo_header.h"

namespace skein {

// Whether the whole photo decodes to 8-bit BGR of the size that its header claims. OpenCV fills
// what a truncated JPEG lacks with grey and says nothing, so a JPEG is run through libjpeg, whose
// warnings about missing or damaged data count as errors here (bytes between segments, which some
// cameras leave, do not); a PNG's chunks are held against their CRC first. Takes about 10 ms a
// megapixel. Call only with a size that is safe to decode.
Status CheckDecodes(const Bytes& bytes, const PhotoHeader& header);

}  // namespace skein
