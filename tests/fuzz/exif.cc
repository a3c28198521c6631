// EXIF, as skein-decoder reads it, and the way of its result to the parent.
#include "codecs/exif_reader.h"
#include "fuzz/fuzz.h"
#include "photo/decoder_wire.h"

namespace skein::fuzz {

SKEIN_FUZZ_TARGET(exif) {
  const ByteView photo(data, size);
  const auto header = ReadPhotoHeader(photo);
  if (!header.ok()) return;
  DecoderAnswer answer;
  answer.exif = ReadExif(photo, *header);
  const Bytes message = EncodeDecoderAnswer(answer);
  Expect(ParseDecoderAnswer(message.data(), message.size()).ok(),
         "the parent takes what the decoder says");
}

}  // namespace skein::fuzz
