// Nodes in processes of their own, over udpm and over LCM's own tcpq relay.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <lcm/lcm.h>
#include <sys/socket.h>
#include <unistd.h>

#include <memory>
#include <random>

#include "auth/session_keys.h"
#include "core/hash.h"
#include "ledger/session_folder.h"
#include "node/ledger_follower.h"
#include "testing/test_folder.h"
#include "testing/test_node.h"
#include "testing/test_process.h"

namespace skein::transport_test {

constexpr int kPort = 7700;
constexpr char kUdpm[] = "udpm://239.255.76.67:7667?ttl=0";
constexpr char kUdpmLeavingTheHost[] = "udpm://239.255.76.67:7667?ttl=1";
constexpr char kTcpq[] = "tcpq://127.0.0.1:7700";

Bytes SeededBytes(size_t size) {
  std::mt19937_64 random(1);
  Bytes bytes(size);
  for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random());
  return bytes;
}

std::string SeededId(size_t size) {
  const Bytes bytes = SeededBytes(size);
  return HashBytes(bytes.data(), bytes.size());
}

// A process called "ingest" with a ledger of num_facts and one blob.
void ServeAsIngest(const std::string& url, int num_facts, size_t blob_bytes) {
  PollLoop loop;
  Bus bus(url, loop);
  Node node(TestOptions("ingest"), loop, bus);
  MemoryIngest ingest(node);
  for (int i = 0; i < num_facts; ++i) ingest.Commit(TestFact("a/" + std::to_string(i)));
  node.blobs().Offer(SeededBytes(blob_bytes));
  loop.Run();
}

std::vector<std::string> StockRelay(int port) {
  return {"java",
          "-Xmx64m",
          "-cp",
          "/usr/share/java/lcm.jar",
          "lcm.lcm.TCPService",
          std::to_string(port)};
}

class TransportTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!EnterOwnNetwork()) GTEST_SKIP() << "needs a network namespace";
  }
  // Pulls the blob of ServeAsIngest; what it cost is printed.
  void ExpectPull(Node& node, size_t blob_bytes, double timeout_s) {
    const Timer timer;
    bool done = false;
    node.blobs().Fetch(SeededId(blob_bytes), "ingest", [&](const Result<Bytes>& fetched) {
      EXPECT_TRUE(fetched.ok() && *fetched == SeededBytes(blob_bytes)) << fetched.error();
      done = true;
    });
    ASSERT_TRUE(node.loop().RunUntil([&] { return done; }, timeout_s));
    std::printf("%.1f MB in %.3f s\n", 1e-6 * static_cast<double>(blob_bytes), timer.ElapsedS());
  }
};

// The worker says nothing to ingest but its heartbeats.
TEST_F(TransportTest, IngestRemembersTheCountersOfAllThatAreAlive) {
  const TestFolder folder;
  NodeOptions options = TestOptions("ingest");
  options.session_id = "";
  options.session_dir = folder.path().string();
  options.lcm_url = kUdpm;
  options.auth = "require";
  options.signer.role = Role::kIngest;
  NodeOptions worker = options;
  worker.instance = "mapper-1";
  worker.signer.role = Role::kWorker;
  const std::string keys = SessionPaths{options.session_dir}.Keys().string();
  const auto open = [&](const std::string& session_id) {
    return *OpenSessionKeys(keys, session_id, Role::kWorker, "mapper-1");
  };
  const std::string session_id = OpenOrCreateSession(options.session_dir)->session_id;
  const PublicKey key = open(session_id).credential.key.public_key();
  const Child worker_process([&] { Node(worker).Run(); });
  {
    Node ingest(options);
    ASSERT_TRUE(
        ingest.loop().RunUntil([&] { return ingest.bus().seal()->Counters().count(key) > 0; }, 30));
  }
  EXPECT_EQ(open(session_id).used.count(key), 1u);
}

TEST_F(TransportTest, UdpmLateJoinerReplaysAndPulls) {
  const Child ingest([] { ServeAsIngest(kUdpm, 3000, 20 << 20); });
  PollLoop loop;
  Bus bus(kUdpm, loop);
  Node node(TestOptions("worker"), loop, bus);
  LedgerFollower follower(node, 1, [](const Fact&) {});
  ASSERT_TRUE(loop.RunUntil([&] { return follower.processed_seq() == 3000; }, 30));
  ExpectPull(node, 20 << 20, 30);
}

// Sends a datagram to the group, as anybody on the network can.
void SendRaw(const std::string& datagram) {
  const int fd = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in group{};
  group.sin_family = AF_INET;
  group.sin_port = htons(7667);
  group.sin_addr.s_addr = inet_addr("239.255.76.67");
  EXPECT_EQ(sendto(fd, datagram.data(), datagram.size(), 0, reinterpret_cast<sockaddr*>(&group),
                   sizeof(group)),
            static_cast<ssize_t>(datagram.size()));
  close(fd);
}

// LCM 1.3.1's library and the decoders that its lcm-gen makes end with SIGSEGV on these.
TEST_F(TransportTest, HostileDatagramsAreDropped) {
  PollLoop loop;
  Bus bus(kUdpm, loop);
  int heard = 0;
  bus.Subscribe(kCommandChannel, [&](const command_t&) { ++heard; });
  command_t command{};
  Bytes bytes(command.getEncodedSize());
  command.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  const std::string fingerprint(bytes.begin(), bytes.begin() + 8);
  const std::string head = std::string("LC02\0\0\0\1", 8) + kCommandChannel.name + '\0';
  SendRaw(head + fingerprint + std::string("\x80\0\0\0x", 5));
  const std::string fragment = std::string("LC03\0\0\0\1\0\0\1\0", 12) + "\xff\xff\xff\xff" +
                               std::string("\0\0\0\2", 4) + kCommandChannel.name + '\0';
  SendRaw(fragment + std::string(1000, 'x'));
  SendRaw(head + std::string(bytes.begin(), bytes.end()));
  ASSERT_TRUE(loop.RunUntil([&] { return heard == 1; }, 10));
  EXPECT_EQ(bus.counters().num_decode_failures, 1);
}

TEST_F(TransportTest, UdpmTalksWithLcmsOwnLibrary) {
  PollLoop loop;
  Bus bus(kUdpm, loop);
  std::string heard;
  bus.Subscribe(kCommandChannel, [&](const command_t& command) { heard = command.verb; });
  const std::unique_ptr<lcm_t, void (*)(lcm_t*)> lcm(lcm_create(kUdpm), lcm_destroy);
  ASSERT_NE(lcm, nullptr);
  command_t command{};
  command.verb = "finish";
  Bytes bytes(command.getEncodedSize());
  command.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  ASSERT_EQ(lcm_publish(lcm.get(), kCommandChannel.name, bytes.data(),
                        static_cast<unsigned int>(bytes.size())),
            0);
  ASSERT_TRUE(loop.RunUntil([&] { return heard == "finish"; }, 10));
  Bytes received;
  const auto keep = [](const lcm_recv_buf_t* buffer, const char*, void* to) {
    const auto* data = static_cast<const uint8_t*>(buffer->data);
    static_cast<Bytes*>(to)->assign(data, data + buffer->data_size);
  };
  ASSERT_NE(lcm_subscribe(lcm.get(), kCommandChannel.name, keep, &received), nullptr);
  bus.Publish(kCommandChannel, command);
  ASSERT_GT(lcm_handle_timeout(lcm.get(), 10'000), 0);
  EXPECT_EQ(received, bytes);
}

TEST_F(TransportTest, UdpmUnderFivePercentLossOnBothSides) {
  const Child ingest([] {
    PollLoop loop;
    Bus bus(kUdpm, loop);
    bus.SetDropReceived(DropShare(0.05, 5));
    Node node(TestOptions("ingest"), loop, bus);
    node.blobs().Offer(SeededBytes(8 << 20));
    loop.Run();
  });
  PollLoop loop;
  Bus bus(kUdpm, loop);
  bus.SetDropReceived(DropShare(0.05, 6));
  Node node(TestOptions("worker"), loop, bus);
  ExpectPull(node, 8 << 20, 60);
}

TEST_F(TransportTest, UdpmWithSmallChunksWhereDatagramsLeaveTheHost) {
  const Child ingest([] { ServeAsIngest(kUdpmLeavingTheHost, 0, 4 << 20); });
  PollLoop loop;
  Bus bus(kUdpmLeavingTheHost, loop);
  Node node(TestOptions("worker"), loop, bus);
  ExpectPull(node, 4 << 20, 30);
}

TEST_F(TransportTest, NodeAdoptsTheSessionItHears) {
  const Child ingest([] { ServeAsIngest(kUdpm, 1, 0); });
  NodeOptions options = TestOptions("worker");
  options.session_id = "auto";
  options.lcm_url = kUdpm;
  options.signer.role = Role::kViewer;
  Node node(options);
  EXPECT_EQ(node.session_id(), "0123456789abcdef");
}

TEST_F(TransportTest, NodeNeedsACredentialToWorkOrToSpeakBeyondThisHost) {
  NodeOptions options = TestOptions("worker");
  options.lcm_url = kUdpm;
  EXPECT_THROW(Node node(options), std::invalid_argument);
  options.auth = "off";
  EXPECT_NO_THROW(Node node(options));
  options.auth.clear();
  options.signer.role = Role::kViewer;
  EXPECT_NO_THROW(Node node(options));
  options.lcm_url = kUdpmLeavingTheHost;
  EXPECT_THROW(Node node(options), std::invalid_argument);
}

TEST_F(TransportTest, NodeSaysWhenItHearsNoSession) {
  NodeOptions options = TestOptions("worker");
  options.session_id = "auto";
  options.lcm_url = kUdpm;
  options.auto_session_timeout_s = 0.2;
  EXPECT_THROW(Node node(options), std::runtime_error);
}

TEST_F(TransportTest, TcpqPullGoesOnWhenTheStockRelayIsKilledAndRestarted) {
  Child main_relay(StockRelay(kPort));
  auto bulk_relay = std::make_unique<Child>(StockRelay(kPort + 1));
  ASSERT_TRUE(WaitForPort(kPort, 30) && WaitForPort(kPort + 1, 30));
  const size_t blob_bytes = 64 << 20;
  const Child ingest([] { ServeAsIngest(kTcpq, 100, 64 << 20); });
  PollLoop loop;
  Bus bus(kTcpq, loop);
  Node node(TestOptions("worker"), loop, bus);
  int64_t at_kill = 0;
  std::unique_ptr<Child> new_main;
  const auto timer = loop.AddTimer(0.005, [&] {
    if (at_kill > 0 || node.blobs().bytes_pulled() < (4 << 20)) return;
    at_kill = node.blobs().bytes_pulled();
    main_relay.Kill();
    bulk_relay->Kill();
    new_main = std::make_unique<Child>(StockRelay(kPort));
    bulk_relay = std::make_unique<Child>(StockRelay(kPort + 1));
  });
  ExpectPull(node, blob_bytes, 60);
  loop.CancelTimer(timer);
  EXPECT_GT(at_kill, 0);
  EXPECT_LT(at_kill, static_cast<int64_t>(blob_bytes));
  LedgerFollower follower(node, 1, [](const Fact&) {});
  EXPECT_TRUE(loop.RunUntil([&] { return follower.processed_seq() == 100; }, 30));
}

TEST_F(TransportTest, TcpqWaitsForARelayThatComesLater) {
  PollLoop loop;
  Bus bus(kTcpq, loop);
  int heard = 0;
  bus.Subscribe(kCommandChannel, [&](const command_t&) { ++heard; });
  EXPECT_FALSE(bus.Publish(kCommandChannel, command_t{}));
  const Child relay(StockRelay(kPort));
  const auto timer = loop.AddTimer(0.05, [&] { bus.Publish(kCommandChannel, command_t{}); });
  EXPECT_TRUE(loop.RunUntil([&] { return heard > 0; }, 30));
  loop.CancelTimer(timer);
}

}  // namespace skein::transport_test
