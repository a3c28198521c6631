#include "transport/udpm_link.h"

#include <gtest/gtest.h>

namespace skein {
namespace {

Bytes Datagram(const std::string& text) { return {text.begin(), text.end()}; }

bool IsTaken(const std::string& text) {
  const Bytes bytes = Datagram(text);
  return ParseLcmDatagram(bytes.data(), bytes.size()).has_value();
}

std::string Text(const char* bytes, size_t size) { return std::string(bytes, size); }

TEST(LcmDatagram, IsLaidOutAsLcmDoes) {
  const std::string message = "hello";
  const Bytes bytes = MakeLcmDatagram(0x01020304, "CHANNEL", message.data(), message.size());
  EXPECT_EQ(bytes, Datagram(Text("LC02\x01\x02\x03\x04"
                                 "CHANNEL\0hello",
                                 21)));
  const auto parsed = ParseLcmDatagram(bytes.data(), bytes.size());
  ASSERT_TRUE(parsed);
  EXPECT_EQ(parsed->channel, "CHANNEL");
  EXPECT_EQ(parsed->message, Datagram(message));
}

TEST(LcmDatagram, MayBeEmpty) { EXPECT_TRUE(IsTaken(Text("LC02\0\0\0\0C\0", 10))); }

// LCM's library writes a fragment where its offset says.
TEST(LcmDatagram, IsNoFragment) {
  EXPECT_FALSE(IsTaken(Text("LC03\0\0\0\1\0\0\1\0\xff\xff\xff\xff\0\0\0\2C\0data", 26)));
}

TEST(LcmDatagram, IsNothingElse) {
  EXPECT_FALSE(IsTaken(""));
  EXPECT_FALSE(IsTaken("LC02"));
  EXPECT_FALSE(IsTaken(Text("LC02\0\0\0\0", 8)));
  EXPECT_FALSE(IsTaken(Text("LC02\0\0\0\0\0data", 13))) << "no channel";
  EXPECT_FALSE(IsTaken(Text("LC02\0\0\0\0CHANNEL", 15))) << "no end of its name";
  EXPECT_FALSE(IsTaken(Text("LC02\0\0\0\0", 8) + std::string(64, 'C') + Text("\0d", 2)));
}

TEST(UdpmLink, SaysWhatGroupItNeeds) {
  PollLoop loop;
  LcmUrl url;
  url.provider = "udpm";
  url.port = 7667;
  for (const char* host : {"10.0.0.1", "host", ""}) {
    url.host = host;
    EXPECT_THROW(UdpmLink(url, loop, [](const std::string&, const Bytes&) {}), std::runtime_error);
  }
}

}  // namespace
}  // namespace skein
