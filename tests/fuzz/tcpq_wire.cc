// The byte stream of tcpq. The first byte says in which pieces it comes.
#include "transport/tcpq_wire.h"

#include <algorithm>
#include <vector>

#include "fuzz/fuzz.h"

namespace {

using namespace skein;
using namespace skein::tcpq;

struct Parsed {
  std::vector<Frame> frames;
  bool broken = false;
};

Parsed Parse(const uint8_t* data, size_t size, size_t piece) {
  FrameParser parser(kClientMagic);
  Parsed parsed;
  for (size_t at = 0; at < size && !parsed.broken; at += piece) {
    parser.Feed(data + at, std::min(piece, size - at));
    Frame frame;
    FrameParser::State state;
    while ((state = parser.Next(&frame)) == FrameParser::State::kFrame) {
      fuzz::Expect(frame.channel.size() <= kMaxChannelBytes, "channels are short");
      parsed.frames.push_back(frame);
    }
    parsed.broken = state == FrameParser::State::kBroken;
  }
  return parsed;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  const Parsed whole = Parse(data + 1, size - 1, size);
  const Parsed pieces = Parse(data + 1, size - 1, 1 + data[0] % 16);
  fuzz::Expect(whole.frames.size() == pieces.frames.size() && whole.broken == pieces.broken,
               "pieces make no difference");
  for (size_t i = 0; i < whole.frames.size(); ++i) {
    fuzz::Expect(whole.frames[i].channel == pieces.frames[i].channel &&
                     whole.frames[i].message == pieces.frames[i].message,
                 "pieces make no difference to a frame");
  }
  return 0;
}
