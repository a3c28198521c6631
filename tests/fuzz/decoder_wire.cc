// What a decoder that a photo took over could say to its parent.
#include "photo/decoder_wire.h"

#include "fuzz/fuzz.h"

using namespace skein;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  ParseDecoderRequest(data, size).ok();
  const auto answer = ParseDecoderAnswer(data, size);
  if (!answer.ok()) return 0;
  const Bytes again = EncodeDecoderAnswer(*answer);
  fuzz::Expect(ParseDecoderAnswer(again.data(), again.size()).ok(), "what is taken can be said");
  return 0;
}
