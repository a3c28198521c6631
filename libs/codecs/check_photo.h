#pragma once

#include "core/result.h"
#include "photo/byte_view.h"
#include "photo/photo_check.h"

namespace skein {

// CheckHeader, then decodes fully and reads EXIF, in this process. What processes that hear a
// network use instead is PhotoDecoder (photo/photo_decoder.h).
Result<CheckedPhoto> CheckPhoto(ByteView bytes, const PhotoLimits& limits);

}  // namespace skein
