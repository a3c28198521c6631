#include "codecs/check_photo.h"

#include "codecs/decode_check.h"
#include "codecs/exif_reader.h"

namespace skein {

Result<CheckedPhoto> CheckPhoto(ByteView bytes, const PhotoLimits& limits) {
  const Result<PhotoHeader> header = CheckHeader(bytes, limits);
  if (!header.ok()) return header.status();
  if (Status status = CheckDecodes(bytes, *header); !status.ok()) return status;
  return CheckedPhoto{*header, ReadExif(bytes, *header)};
}

}  // namespace skein
