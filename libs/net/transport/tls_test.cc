#include "transport/tls.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <string>
#include <utility>
#include <vector>

#include "testing/test_folder.h"

namespace skein::tls_test {

class TlsTest : public testing::Test {
 protected:
  RelayCertificate Certificate(const std::string& name) {
    auto made = OpenRelayCertificate((folder_ / name).string());
    EXPECT_TRUE(made.ok()) << made.error();
    return *made;
  }
  // Two ends of a connection that never block.
  static std::pair<int, int> Connection() {
    int ends[2];
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends), 0);
    return {ends[0], ends[1]};
  }
  // What the other side got of `text`. Both sides take their turns, as two loops would.
  static std::string Pass(Stream& from, Stream& to, const std::string& text) {
    std::string got;
    size_t sent = 0;
    uint8_t buffer[Stream::kMinRoom];
    for (int round = 0; round < 10'000 && got.size() < text.size(); ++round) {
      if (sent < text.size()) {
        const auto* data = reinterpret_cast<const uint8_t*>(text.data());
        sent += from.Send(data + sent, text.size() - sent).bytes;
      }
      const Stream::Moved moved = to.Receive(buffer, sizeof(buffer));
      got.append(buffer, buffer + moved.bytes);
      if (from.Receive(buffer, sizeof(buffer)).is_over || moved.is_over) break;
    }
    return got;
  }

  const TestFolder folder_;
  const RelayCertificate certificate_ = Certificate("keys");
};

TEST_F(TlsTest, CarriesBytesBothWaysWithoutShowingThem) {
  const auto [relay_end, client_end] = Connection();
  const auto relay = TlsContext::ForRelay(certificate_).Wrap(relay_end);
  const auto client = TlsContext::ForClient(certificate_.pin).Wrap(client_end);
  EXPECT_EQ(Pass(*client, *relay, "a photo's name"), "a photo's name");
  EXPECT_EQ(Pass(*relay, *client, std::string(300'000, 'x')), std::string(300'000, 'x'));
  const std::string secret = "another photo's name";
  ASSERT_EQ(client->Send(reinterpret_cast<const uint8_t*>(secret.data()), secret.size()).bytes,
            secret.size());
  std::string seen(4096, 0);
  seen.resize(static_cast<size_t>(::recv(relay_end, seen.data(), seen.size(), MSG_PEEK)));
  EXPECT_GE(seen.size(), secret.size());
  EXPECT_EQ(seen.find(secret), std::string::npos);
}

TEST_F(TlsTest, BothEndsKnowBytesOfTheirConnectionAlone) {
  std::vector<Bytes> bindings;
  for (int i = 0; i < 2; ++i) {
    const auto [relay_end, client_end] = Connection();
    const auto relay = TlsContext::ForRelay(certificate_).Wrap(relay_end);
    const auto client = TlsContext::ForClient(certificate_.pin).Wrap(client_end);
    EXPECT_FALSE(relay->Binding() || client->Binding());
    Pass(*client, *relay, "a photo's name");
    ASSERT_TRUE(relay->Binding() && client->Binding());
    EXPECT_EQ(*relay->Binding(), *client->Binding());
    bindings.push_back(*client->Binding());
  }
  EXPECT_EQ(bindings[0].size(), 32u);
  EXPECT_NE(bindings[0], bindings[1]);
}

TEST_F(TlsTest, AClientTakesTheCertificateOfItsPinAlone) {
  const auto [relay_end, client_end] = Connection();
  const auto relay = TlsContext::ForRelay(Certificate("other")).Wrap(relay_end);
  const auto client = TlsContext::ForClient(certificate_.pin).Wrap(client_end);
  EXPECT_EQ(Pass(*client, *relay, "a photo's name"), "");
  EXPECT_NE(client->error().find("not " + certificate_.pin), std::string::npos) << client->error();
  EXPECT_NE(client->error().find("ask for a new invitation"), std::string::npos);
}

TEST_F(TlsTest, SaysThatTheOtherSideHasNoTls) {
  for (const bool is_relay : {false, true}) {
    const auto [own_end, other_end] = Connection();
    const auto own = is_relay ? TlsContext::ForRelay(certificate_).Wrap(own_end)
                              : TlsContext::ForClient(certificate_.pin).Wrap(own_end);
    Stream other(other_end);
    EXPECT_EQ(Pass(other, *own, "\x28\x76\x17\xfb and no TLS record"), "");
    EXPECT_NE(own->error().find("does not speak TLS"), std::string::npos) << own->error();
  }
}

TEST_F(TlsTest, NoticesThatTheOtherSideLeft) {
  const auto [relay_end, client_end] = Connection();
  const auto relay = TlsContext::ForRelay(certificate_).Wrap(relay_end);
  auto client = TlsContext::ForClient(certificate_.pin).Wrap(client_end);
  ASSERT_EQ(Pass(*client, *relay, "x"), "x");
  client.reset();
  uint8_t buffer[Stream::kMinRoom];
  EXPECT_TRUE(relay->Receive(buffer, sizeof(buffer)).is_over);
}

TEST_F(TlsTest, TakesNoUnusablePinOrCertificate) {
  EXPECT_THROW(TlsContext::ForClient(""), std::invalid_argument);
  EXPECT_THROW(TlsContext::ForClient("abc"), std::invalid_argument);
  EXPECT_THROW(TlsContext::ForRelay({"no PEM", certificate_.pin}), std::invalid_argument);
}

}  // namespace skein::tls_test
