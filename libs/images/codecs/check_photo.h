#pragma once

#include "core/result.h"
#include "photo/byte_view.h"
#include "photo/photo_check.h"

namespace skein {

// CheckHeader, then decodes fully and reads EXIF, in this process. Processes that hear a network
// use PhotoDecoder (photo/photo_decoder.h) instead.
Result<CheckedPhoto> CheckPhoto(ByteView bytes, const PhotoLimits& limits);

}  // namespace skein
