// The byte stream of tcpq. The first byte says in which pieces it comes.
#include "transport/tcpq_wire.h"

#include <algorithm>
#include <vector>

#include "fuzz/fuzz.h"

namespace skein::fuzz {
namespace {

struct ParsedStream {
  std::vector<tcpq::Frame> frames;
  bool broken = false;
};

ParsedStream ParsePieces(const uint8_t* data, size_t size, size_t piece) {
  tcpq::FrameParser parser(tcpq::kClientMagic);
  ParsedStream parsed;
  for (size_t at = 0; at < size && !parsed.broken; at += piece) {
    parser.Feed(data + at, std::min(piece, size - at));
    tcpq::Frame frame;
    tcpq::FrameParser::State state;
    while ((state = parser.Next(&frame)) == tcpq::FrameParser::State::kFrame) {
      Expect(frame.channel.size() <= tcpq::kMaxChannelBytes, "channels are short");
      parsed.frames.push_back(frame);
    }
    parsed.broken = state == tcpq::FrameParser::State::kBroken;
  }
  return parsed;
}

}  // namespace

SKEIN_FUZZ_TARGET(tcpq_wire) {
  if (size == 0) return;
  const ParsedStream whole = ParsePieces(data + 1, size - 1, size);
  const ParsedStream pieces = ParsePieces(data + 1, size - 1, 1 + data[0] % 16);
  Expect(whole.frames.size() == pieces.frames.size() && whole.broken == pieces.broken,
         "pieces make no difference");
  for (size_t i = 0; i < whole.frames.size(); ++i) {
    Expect(whole.frames[i].channel == pieces.frames[i].channel &&
               whole.frames[i].message == pieces.frames[i].message,
           "pieces make no difference to a frame");
  }
}

}  // namespace skein::fuzz
