// EXIF, as skein-decoder reads it, and the way of its result to the parent.
#include "codecs/exif_reader.h"
#include "fuzz/fuzz.h"
#include "photo/decoder_wire.h"

using namespace skein;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const ByteView photo(data, size);
  const auto header = ReadPhotoHeader(photo);
  if (!header.ok()) return 0;
  DecoderAnswer answer;
  answer.exif = ReadExif(photo, *header);
  const Bytes message = EncodeDecoderAnswer(answer);
  fuzz::Expect(ParseDecoderAnswer(message.data(), message.size()).ok(),
               "the parent takes what the decoder says");
  return 0;
}
