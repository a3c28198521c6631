// What a decoder that a photo took over could say to its parent.
#include "photo/decoder_wire.h"

#include "fuzz/fuzz.h"

namespace skein::fuzz {

SKEIN_FUZZ_TARGET(decoder_wire) {
  ParseDecoderRequest(data, size).ok();
  const auto answer = ParseDecoderAnswer(data, size);
  if (!answer.ok()) return;
  const Bytes again = EncodeDecoderAnswer(*answer);
  Expect(ParseDecoderAnswer(again.data(), again.size()).ok(), "what is taken can be said");
}

}  // namespace skein::fuzz
