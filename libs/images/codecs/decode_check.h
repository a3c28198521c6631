#pragma once

#include "core/result.h"
#include "photo/byte_view.h"
#include "photo/photo_header.h"

namespace skein {

// Whether the whole photo decodes to 8-bit BGR of the size in its header. OpenCV silently fills a
// truncated JPEG with grey. So a JPEG is run through libjpeg, and its warnings about missing or
// damaged data are errors. Bytes between segments, which some cameras leave, are not. A PNG's
// chunks are checked against their CRC first. Takes about 10 ms a megapixel. Call it only with a
// size that is safe to decode.
Status CheckDecodes(ByteView bytes, const PhotoHeader& header);

}  // namespace skein
