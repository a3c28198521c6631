#include "transport/tcpq_wire.h"

#include <gtest/gtest.h>

namespace skein::tcpq {
namespace tcpq_wire_test {

using State = FrameParser::State;

TEST(TcpqWire, ParsesFramesFromPiecesOfAnySize) {
  Bytes stream;
  AppendGreeting(kServerMagic, &stream);
  AppendPublish("CHANNEL", "abc", 3, &stream);
  AppendSubscription(FrameType::kSubscribe, "OTHER", &stream);
  AppendPublish("EMPTY", "", 0, &stream);
  for (const size_t piece : {size_t{1}, size_t{3}, stream.size()}) {
    FrameParser parser(kServerMagic);
    std::vector<Frame> frames;
    for (size_t at = 0; at < stream.size(); at += piece) {
      parser.Feed(stream.data() + at, std::min(piece, stream.size() - at));
      Frame frame;
      while (parser.Next(&frame) == State::kFrame) frames.push_back(frame);
    }
    ASSERT_EQ(frames.size(), 3u);
    EXPECT_EQ(frames[0].channel, "CHANNEL");
    EXPECT_EQ(frames[0].message, (Bytes{'a', 'b', 'c'}));
    EXPECT_EQ(frames[1].type, FrameType::kSubscribe);
    EXPECT_EQ(frames[1].channel, "OTHER");
    EXPECT_TRUE(frames[2].message.empty());
  }
}

TEST(TcpqWire, HangsUpOnAnotherProtocolAndOnSizesThatCannotBe) {
  Frame frame;
  FrameParser http(kServerMagic);
  const std::string reply = "HTTP/1.1 400";
  http.Feed(reinterpret_cast<const uint8_t*>(reply.data()), reply.size());
  EXPECT_EQ(http.Next(&frame), State::kBroken);

  Bytes stream;
  AppendGreeting(kServerMagic, &stream);
  const Bytes huge = {0, 0, 0, 1, 0x7F, 0xFF, 0xFF, 0xFF};
  stream.insert(stream.end(), huge.begin(), huge.end());
  FrameParser parser(kServerMagic);
  parser.Feed(stream.data(), stream.size());
  EXPECT_EQ(parser.Next(&frame), State::kBroken);
}

}  // namespace tcpq_wire_test
}  // namespace skein::tcpq
