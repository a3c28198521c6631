#include "relay/relay.h"

#include <gtest/gtest.h>
#include <lcm/lcm.h>

#include <memory>
#include <string>
#include <utility>

#include "auth/relay_certificate.h"
#include "core/clock.h"
#include "core/hash.h"
#include "testing/test_folder.h"
#include "testing/test_node.h"
#include "testing/test_process.h"

namespace skein::relay_test {

constexpr int kPort = 7700;
constexpr char kUrl[] = "tcpq://127.0.0.1:7700";

void RunRelays() {
  PollLoop loop;
  Relay main_relay(loop, {kPort});
  Relay bulk_relay(loop, {kPort + 1});
  loop.Run();
}

// A client that listens until it is stopped.
void ListenToCommands(const std::string& url) {
  PollLoop loop;
  Bus bus(url, loop);
  bus.Subscribe(kCommandChannel, [](const command_t&) {});
  loop.Run();
}

class RelayTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!EnterOwnNetwork()) GTEST_SKIP() << "needs a network namespace";
  }
  // Publishes num_messages of 30 KB each, as they arrive again; how many came back in time.
  int Echo(Bus& bus, PollLoop& loop, int num_messages, double timeout_s) {
    command_t command{};
    command.sender = "chief";
    command.argument = std::string(30000, 'x');
    int heard = 0, sent = 0;
    const auto subscription = bus.Subscribe(kCommandChannel, [&](const command_t&) { ++heard; });
    const auto timer = loop.AddTimer(0.001, [&] {
      for (int i = 0; i < 10 && sent < num_messages && sent < heard + 50; ++i) {
        if (bus.Publish(kCommandChannel, command)) ++sent;
      }
    });
    loop.RunUntil([&] { return heard == num_messages; }, timeout_s);
    loop.CancelTimer(timer);
    bus.Unsubscribe(subscription);
    return heard;
  }
};

TEST_F(RelayTest, OneStoppedClientStallsNobodyElse) {
  const Child relays(RunRelays);
  ASSERT_TRUE(WaitForPort(kPort, 10));
  const Child stopped([] { ListenToCommands(kUrl); });
  PollLoop loop;
  Bus bus(kUrl, loop);
  ASSERT_EQ(Echo(bus, loop, 100, 30), 100);  // everyone has joined
  stopped.Signal(SIGSTOP);
  // 60 MB: beyond the stopped client's socket buffers and its queue.
  EXPECT_EQ(Echo(bus, loop, 2000, 60), 2000);
  stopped.Signal(SIGCONT);
}

// The reason for Skein's own relay. Says what it sees; does not demand that the other one stalls.
TEST_F(RelayTest, TheStockRelayIsMeasuredBesideIt) {
  const Child relay(std::vector<std::string>{"java", "-Xmx64m", "-cp", "/usr/share/java/lcm.jar",
                                             "lcm.lcm.TCPService", std::to_string(kPort)});
  ASSERT_TRUE(WaitForPort(kPort, 30));
  const Child stopped([] { ListenToCommands(kUrl); });
  PollLoop loop;
  Bus bus(kUrl, loop);
  // It starts a client's thread before it lists the client, so the client's first message may not
  // come back.
  bool is_listed = false;
  for (int i = 0; i < 30 && !is_listed; ++i) is_listed = Echo(bus, loop, 1, 1) == 1;
  ASSERT_TRUE(is_listed);
  ASSERT_EQ(Echo(bus, loop, 100, 30), 100);
  stopped.Signal(SIGSTOP);
  std::printf("LCM's relay with one stopped client: %d of 2000 messages of 30 KB in 5 s\n",
              Echo(bus, loop, 2000, 5));
  stopped.Signal(SIGCONT);
}

TEST_F(RelayTest, StockLcmClientsTalkThroughIt) {
  const Child relays(RunRelays);
  ASSERT_TRUE(WaitForPort(kPort, 10));
  lcm_t* lcm = ::lcm_create(kUrl);
  ASSERT_NE(lcm, nullptr);
  int heard = 0;
  const auto count = [](const lcm_recv_buf_t*, const char*, void* user) {
    ++*static_cast<int*>(user);
  };
  ::lcm_subscribe(lcm, "A_.*", count, &heard);
  for (const char* channel : {"B_X", "A_X", "X_A", "A_Y"}) ::lcm_publish(lcm, channel, "abc", 3);
  while (heard < 2 && ::lcm_handle_timeout(lcm, 5000) > 0) continue;
  EXPECT_EQ(heard, 2);
  EXPECT_EQ(::lcm_handle_timeout(lcm, 50), 0);
  ::lcm_destroy(lcm);
}

TEST_F(RelayTest, PullsGoOnOverItsRestart) {
  auto relays = std::make_unique<Child>(RunRelays);
  ASSERT_TRUE(WaitForPort(kPort + 1, 10));
  const Bytes blob(64 << 20, 7);
  const Child owner_process([&blob] {
    PollLoop loop;
    Bus bus(kUrl, loop);
    Node owner(TestOptions("owner"), loop, bus);
    owner.blobs().Offer(blob);
    loop.Run();
  });
  PollLoop loop;
  Bus bus(kUrl, loop);
  Node reader(TestOptions("reader"), loop, bus);
  bool done = false;
  const auto id = HashBytes(blob.data(), blob.size());
  reader.blobs().Fetch(id, "owner", [&](const Result<Bytes>& fetched) {
    EXPECT_TRUE(fetched.ok() && *fetched == blob);
    done = true;
  });
  ASSERT_TRUE(loop.RunUntil([&] { return reader.blobs().bytes_pulled() > (4 << 20); }, 30));
  relays->Kill();
  EXPECT_FALSE(done);
  relays = std::make_unique<Child>(RunRelays);
  EXPECT_TRUE(loop.RunUntil([&] { return done; }, 60));
}

TEST_F(RelayTest, CarriesMessagesThroughTls) {
  const TestFolder folder, other;
  const auto certificate = OpenRelayCertificate((folder / "keys").string());
  ASSERT_TRUE(certificate.ok()) << certificate.error();
  PollLoop loop;
  RelayOptions options{kPort};
  options.tls = TlsContext::ForRelay(*certificate);
  Relay relay(loop, options);
  Bus bus("tcpqs://127.0.0.1:7700?pin=" + certificate->pin, loop);
  EXPECT_EQ(Echo(bus, loop, 500, 30), 500);
  Bus wrong("tcpqs://127.0.0.1:7700?pin=" + OpenRelayCertificate((other / "keys").string())->pin,
            loop);
  EXPECT_EQ(Echo(wrong, loop, 1, 1), 0);
  Bus plain(kUrl, loop);
  EXPECT_EQ(Echo(plain, loop, 1, 1), 0);
  EXPECT_EQ(Echo(bus, loop, 10, 30), 10);
}

TEST_F(RelayTest, OverTlsOneStoppedClientStallsNobodyElse) {
  const TestFolder folder;
  const auto certificate = OpenRelayCertificate((folder / "keys").string());
  ASSERT_TRUE(certificate.ok()) << certificate.error();
  const Child relays([&] {
    PollLoop loop;
    RelayOptions options{kPort};
    options.tls = TlsContext::ForRelay(*certificate);
    Relay relay(loop, options);
    loop.Run();
  });
  ASSERT_TRUE(WaitForPort(kPort, 10));
  const std::string url = "tcpqs://127.0.0.1:7700?pin=" + certificate->pin;
  const Child stopped([&] { ListenToCommands(url); });
  PollLoop loop;
  Bus bus(url, loop);
  ASSERT_EQ(Echo(bus, loop, 100, 30), 100);
  stopped.Signal(SIGSTOP);
  EXPECT_EQ(Echo(bus, loop, 2000, 60), 2000);
  stopped.Signal(SIGCONT);
}

TEST_F(RelayTest, WhoListensOnTheWatchPortIsNotHeard) {
  PollLoop loop;
  RelayOptions options{kPort};
  options.watch_port = 0;
  Relay relay(loop, options);
  Bus bus(kUrl, loop);
  Bus watcher("tcpq://127.0.0.1:" + std::to_string(relay.watch_port()), loop);
  int heard = 0, watched = 0;
  const auto count = [](int* number) {
    return [number](const command_t& command) {
      EXPECT_EQ(command.verb, "said on the session's port");
      ++*number;
    };
  };
  bus.Subscribe(kCommandChannel, count(&heard));
  watcher.Subscribe(kCommandChannel, count(&watched));
  loop.AddTimer(0.01, [&] {
    command_t command{};
    command.verb = "said on the watch port";
    watcher.Publish(kCommandChannel, command);
    command.verb = "said on the session's port";
    bus.Publish(kCommandChannel, command);
  });
  EXPECT_TRUE(loop.RunUntil(
      [&] { return relay.counters().num_refused >= 5 && watched >= 5 && heard >= 5; }, 10));
}

TEST_F(RelayTest, ForwardsNothingUnsignedWhereSignaturesAreRequired) {
  const std::string session = "0123456789abcdef";
  const SigningKey root = SigningKey::Generate();
  const auto seal = [&](Role role, const std::string& name) {
    return MessageSeal({session, root.public_key()}, IssueCredential(root, session, role, name, 0),
                       {}, NowUs);
  };
  PollLoop loop;
  Relay relay(loop, {kPort}, std::make_unique<RelayGuard>(seal(Role::kViewer, "relay"), false));
  Bus chief(kUrl, loop), nobody(kUrl, loop);
  chief.SetSeal(std::make_unique<MessageSeal>(seal(Role::kOperator, "chief")), false);
  int heard = 0;
  Bus listener(kUrl, loop);  // takes all
  listener.Subscribe(kCommandChannel, [&](const command_t& command) {
    ++heard;
    EXPECT_EQ(command.verb, "finish");
  });
  const auto timer = loop.AddTimer(0.01, [&] {
    command_t command{};
    command.verb = "forged";
    nobody.Publish(kCommandChannel, command);
    command.verb = "finish";
    command.sender = "chief";
    chief.Publish(kCommandChannel, command);
  });
  EXPECT_TRUE(loop.RunUntil([&] { return heard >= 5 && relay.counters().num_refused >= 5; }, 10));
  loop.CancelTimer(timer);
}

// Relays over TLS that only members of the session hear.
class MembersRelayTest : public RelayTest {
 protected:
  void SetUp() override {
    RelayTest::SetUp();
    if (IsSkipped()) return;
    const auto certificate = OpenRelayCertificate((folder_ / "keys").string());
    ASSERT_TRUE(certificate.ok()) << certificate.error();
    pin_ = certificate->pin;
    options_.tls = TlsContext::ForRelay(*certificate);
    options_.members_only = true;
  }
  MessageSeal SealOf(const std::string& name) const {
    return MessageSeal({kSession, root_.public_key()},
                       IssueCredential(root_, kSession, Role::kViewer, name, 0), {}, NowUs);
  }
  std::unique_ptr<Relay> MakeRelay(int port) {
    options_.port = port;
    return std::make_unique<Relay>(loop_, options_,
                                   std::make_unique<RelayGuard>(SealOf("relay"), false));
  }
  std::string UrlOf(int port) const {
    return "tcpqs://127.0.0.1:" + std::to_string(port) + "?pin=" + pin_;
  }

  const std::string kSession = "0123456789abcdef";
  const SigningKey root_ = SigningKey::Generate();
  const TestFolder folder_;
  PollLoop loop_;
  RelayOptions options_{kPort};
  std::string pin_;
};

TEST_F(MembersRelayTest, WhoHasNoCredentialHearsNothing) {
  const auto relay = MakeRelay(kPort);
  Relay bulk_relay(loop_, {kPort + 1});  // none of its clients has TLS
  const std::string url = UrlOf(kPort);
  Bus speaker(url, loop_), member(url, loop_), nobody(url, loop_);
  speaker.SetSeal(std::make_unique<MessageSeal>(SealOf("speaker")), false);
  member.SetSeal(std::make_unique<MessageSeal>(SealOf("member")), false);
  int num_member = 0, num_nobody = 0;
  member.Subscribe(kHeartbeatChannel, [&](const heartbeat_t&) { ++num_member; });
  nobody.Subscribe(kHeartbeatChannel, [&](const heartbeat_t&) { ++num_nobody; });
  loop_.AddTimer(0.01, [&] {
    heartbeat_t beat{};
    beat.instance = "speaker";
    speaker.Publish(kHeartbeatChannel, beat);
  });
  EXPECT_TRUE(loop_.RunUntil([&] { return num_member >= 20; }, 10));
  EXPECT_EQ(num_nobody, 0);
}

// One that signs nothing, but says again what a member has signed.
TEST_F(MembersRelayTest, WhatAnotherSignedMakesNoMember) {
  const auto relay = MakeRelay(kPort), other_relay = MakeRelay(kPort + 1);
  const auto connect = [&](const Relay& to, int* num_heard) {
    auto link = MakeLink(ParseLcmUrl(UrlOf(to.port())), loop_,
                         [num_heard](const std::string&, const Bytes&) { ++*num_heard; });
    link->Subscribe(kHeartbeatChannel.name);
    return link;
  };
  int num_member = 0, num_thief = 0;
  const auto member = connect(*relay, &num_member), thief = connect(*relay, &num_thief);
  const auto other_thief = connect(*other_relay, &num_thief);
  ASSERT_TRUE(loop_.RunUntil(
      [&] { return member->Binding() && thief->Binding() && other_thief->Binding(); }, 10));
  MessageSeal seal_of_member = SealOf("member");
  const auto say = [&](Link& link, const char* channel, const Bytes& message) {
    link.Publish(channel, message.data(), message.size());
  };
  const auto timer = loop_.AddTimer(0.01, [&] {
    const Bytes hello = seal_of_member.Seal(tcpq::kHelloChannel, *member->Binding());
    for (Link* link : {thief.get(), other_thief.get(), member.get()}) {
      say(*link, tcpq::kHelloChannel, hello);
      // The relays know nothing of each other: each takes what the other has heard.
      say(*link, kHeartbeatChannel.name, seal_of_member.Seal(kHeartbeatChannel.name, {1}));
    }
  });
  EXPECT_TRUE(loop_.RunUntil(
      [&] { return num_member >= 20 && other_relay->counters().num_messages >= 40; }, 10));
  EXPECT_EQ(num_thief, 0);
  loop_.CancelTimer(timer);
}

// The relay's CPU time for 1,000 messages of 30 KB that go to one client. Prints, demands nothing.
TEST_F(RelayTest, CostOfTlsAndSignaturesMeasured) {
  const std::string session = "0123456789abcdef";
  const SigningKey root = SigningKey::Generate();
  const auto seal = [&] {
    return std::make_unique<MessageSeal>(
        SessionTrust{session, root.public_key()},
        IssueCredential(root, session, Role::kOperator, "chief", 0), SignerCounters(), NowUs);
  };
  const TestFolder folder;
  const auto certificate = OpenRelayCertificate((folder / "keys").string());
  ASSERT_TRUE(certificate.ok()) << certificate.error();
  for (const bool is_encrypted : {false, true}) {
    for (const bool is_guarded : {false, true}) {
      const Child relay_process([&] {
        PollLoop loop;
        RelayOptions options{kPort};
        if (is_encrypted) options.tls = TlsContext::ForRelay(*certificate);
        Relay relay(loop, options,
                    is_guarded ? std::make_unique<RelayGuard>(std::move(*seal()), false) : nullptr);
        loop.Run();
      });
      ASSERT_TRUE(WaitForPort(kPort, 10));
      PollLoop loop;
      Bus bus(is_encrypted ? "tcpqs://127.0.0.1:7700?pin=" + certificate->pin : kUrl, loop);
      bus.SetSeal(seal(), false);
      ASSERT_EQ(Echo(bus, loop, 10, 30), 10);
      clockid_t clock;
      timespec before{}, after{};
      ::clock_getcpuclockid(relay_process.pid(), &clock);
      ::clock_gettime(clock, &before);
      EXPECT_EQ(Echo(bus, loop, 1000, 60), 1000);
      ::clock_gettime(clock, &after);
      std::printf("%s, signatures %s: %.0f us of the relay's CPU time a message\n",
                  is_encrypted ? "TLS" : "in the clear", is_guarded ? "checked" : "not checked",
                  1e3 * (after.tv_sec - before.tv_sec) + 1e-6 * (after.tv_nsec - before.tv_nsec));
    }
  }
}

TEST_F(RelayTest, HangsUpOnWhoSpeaksAnotherProtocol) {
  PollLoop loop;
  Relay relay(loop, {});
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<uint16_t>(relay.port()));
  ASSERT_EQ(::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  ASSERT_TRUE(loop.RunUntil([&] { return relay.num_clients() == 1; }, 10));
  ASSERT_EQ(::write(fd, "GET / HTTP/1.1\r\n", 16), 16);
  EXPECT_TRUE(loop.RunUntil([&] { return relay.num_clients() == 0; }, 10));
  ::close(fd);
}

}  // namespace skein::relay_test
