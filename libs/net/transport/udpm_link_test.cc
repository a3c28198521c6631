#include "transport/udpm_link.h"

#include <gtest/gtest.h>
#include <malloc.h>

namespace skein::udpm_link_test {

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

// What the allocator holds, of tiny datagrams mostly its own overhead.
TEST(DatagramQueue, HoldsNoMoreMemoryThanItsBoundHoweverSmallTheDatagrams) {
  constexpr size_t kMaxBytes = 4 << 20;
  for (const size_t message_bytes : {size_t{0}, size_t{1}, size_t{25}, size_t{1000}}) {
    for (const std::string& channel : {std::string("C"), std::string(16, 'C')}) {
      const auto before = mallinfo2();
      DatagramQueue queue(kMaxBytes);
      while (queue.Push({channel, Bytes(message_bytes)})) continue;
      const auto after = mallinfo2();
      const size_t held = after.uordblks - before.uordblks + (after.hblkhd - before.hblkhd);
      EXPECT_LE(held, kMaxBytes) << message_bytes << " bytes on " << channel;
      EXPECT_GE(held, kMaxBytes / 3) << message_bytes << " bytes on " << channel;
    }
  }
}

TEST(DatagramQueue, HasRoomAgainForWhatWasTaken) {
  DatagramQueue queue(1000);
  size_t num_pushed = 0;
  while (queue.Push({std::to_string(num_pushed), Bytes(10)})) ++num_pushed;
  ASSERT_GT(num_pushed, 2u);
  for (size_t i = 0; i < 100; ++i) {
    const auto datagram = queue.Pop();
    ASSERT_TRUE(datagram);
    EXPECT_EQ(datagram->channel, std::to_string(i));
    EXPECT_TRUE(queue.Push({std::to_string(num_pushed + i), Bytes(10)}));
  }
  EXPECT_EQ(queue.size(), num_pushed);
  while (queue.size() > 0) queue.Pop();
  EXPECT_FALSE(queue.Pop());
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

}  // namespace skein::udpm_link_test
