// What a client may take of the relay, which is everyone's.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <time.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "relay/relay.h"
#include "testing/raw_client.h"
#include "testing/test_process.h"
#include "transport/link.h"

namespace skein::relay_limits_test {

constexpr double kSoonS = 10;

class RelayLimits : public testing::Test {
 protected:
  void SetUp() override {
    if (!EnterOwnNetwork()) GTEST_SKIP() << "needs a network namespace";
  }
  // One relay in this process, whose clock the test sets.
  Relay& Start(RelayOptions options = {}) {
    relay_ = std::make_unique<Relay>(loop_, options);
    return *relay_;
  }
  RawClient& Connect(const char* from = "127.0.0.1") {
    clients_.push_back(std::make_unique<RawClient>(relay_->port(), from));
    EXPECT_TRUE(clients_.back()->connected());
    return *clients_.back();
  }
  RawClient& Join(const char* from = "127.0.0.1") {
    RawClient& client = Connect(from);
    client.Greet();
    client.Subscribe("A");
    client.Publish("A", 1);
    EXPECT_TRUE(Until([&] { return client.NumHeard() == 1; }));
    return client;
  }
  MessageSeal SealOf(const std::string& viewer) {
    constexpr char kSession[] = "0123456789abcdef";
    return MessageSeal({kSession, root_.public_key()},
                       IssueCredential(root_, kSession, Role::kViewer, viewer, 0), {},
                       [this] { return static_cast<int64_t>(now_s_ * 1e6); });
  }
  // All are to sign.
  void StartGuarded(const RelayOptions& options = {}) {
    relay_ = std::make_unique<Relay>(loop_, options,
                                     std::make_unique<RelayGuard>(SealOf("relay"), false));
  }
  static Bytes SignedFrame(MessageSeal* seal) {
    Bytes frame;
    const Bytes message = seal->Seal("SKEIN_HEARTBEAT", Bytes(100, 7));
    tcpq::AppendPublish("SKEIN_HEARTBEAT", message.data(), message.size(), &frame);
    return frame;
  }
  static Bytes SignedFrames(int count, MessageSeal* seal) {
    Bytes frames;
    for (int i = 0; i < count; ++i) {
      const Bytes frame = SignedFrame(seal);
      frames.insert(frames.end(), frame.begin(), frame.end());
    }
    return frames;
  }
  bool Until(const std::function<bool()>& done) { return loop_.RunUntil(done, kSoonS); }
  // Whatever is due by now has happened.
  void Settle() {
    bool passed = false;
    loop_.AddOneShot(0, [&] { passed = true; });
    now_s_ += 0.001;
    ASSERT_TRUE(Until([&] { return passed; }));
  }

  double now_s_ = 1000, step_s_ = 0;
  PollLoop loop_{[this] { return now_s_ += step_s_; }};
  const SigningKey root_ = SigningKey::Generate();
  std::unique_ptr<Relay> relay_;
  std::deque<std::unique_ptr<RawClient>> clients_;
};

TEST_F(RelayLimits, WhoSaysNothingIsHungUpOn) {
  Start();
  RawClient& good = Join();
  RawClient& silent = Connect();
  ASSERT_TRUE(Until([&] { return relay_->num_clients() == 2; }));
  now_s_ += 4.9;
  Settle();
  EXPECT_TRUE(silent.IsOpen());
  now_s_ += 0.6;
  EXPECT_TRUE(Until([&] { return !silent.IsOpen(); }));
  EXPECT_TRUE(good.IsOpen());
  EXPECT_EQ(relay_->counters().num_expelled, 1);
}

// Checking the signatures of one member that floods took 40 % of a core of the relay, and as much
// of ingest.
TEST_F(RelayLimits, WhoSaysTooMuchIsReadLaterAndLosesNothing) {
  constexpr int kPerS = 100;
  RelayOptions options;
  options.max_messages_per_s = kPerS;
  StartGuarded(options);
  RawClient& good = Connect();
  good.Greet();
  good.Subscribe("SKEIN_HEARTBEAT");
  RawClient& flood = Connect();
  flood.Greet();
  MessageSeal mallory = SealOf("mallory"), viewer = SealOf("viewer");
  for (int i = 0; i < 240; ++i) flood.Send(SignedFrame(&mallory));
  const auto num_messages = [&] { return relay_->counters().num_messages; };
  ASSERT_TRUE(Until([&] { return num_messages() == kPerS && good.NumHeard() == kPerS; }));
  Settle();
  EXPECT_EQ(num_messages(), kPerS) << "of the others no signature is checked";
  good.Send(SignedFrame(&viewer));
  EXPECT_TRUE(Until([&] { return good.NumHeard() == kPerS + 1; })) << "waits for no flood";

  now_s_ += 0.5;
  EXPECT_TRUE(Until([&] { return num_messages() == 151; }));
  Settle();
  EXPECT_EQ(num_messages(), 151);
  now_s_ += 1.1;
  EXPECT_TRUE(Until([&] { return good.NumHeard() == 241; })) << "nothing is lost";
  EXPECT_EQ(relay_->counters().num_held_up, 2);
}

// It is read late, so what it says is whole late.
TEST_F(RelayLimits, WhoSaysTooMuchForLongIsNotTakenForOneWhoseMessageDoesNotEnd) {
  RelayOptions options;
  options.max_messages_per_s = 10;
  StartGuarded(options);
  RawClient& flood = Connect();
  flood.Greet();
  flood.Subscribe("SKEIN_HEARTBEAT");
  MessageSeal mallory = SealOf("mallory");
  Bytes frames = SignedFrames(200, &mallory);
  const size_t end = frames.size();
  const Bytes last = SignedFrame(&mallory);
  frames.insert(frames.end(), last.begin(), last.end());
  flood.Send(frames, end + 1);
  for (int i = 0; i < 500 && flood.NumHeard() < 200; ++i) {
    now_s_ += 0.05;
    Settle();
  }
  EXPECT_EQ(flood.NumHeard(), 200);
  now_s_ += 9;
  Settle();
  EXPECT_TRUE(flood.IsOpen());
  now_s_ += 1.6;
  EXPECT_TRUE(Until([&] { return !flood.IsOpen(); })) << "now its message does not end";
}

// The allowance was looked at twice: what filled up in between left frames behind of which no
// descriptor tells.
TEST_F(RelayLimits, AnAllowanceThatFillsUpDuringATurnLosesNothing) {
  constexpr int kPerS = 100, kNumFrames = 240;  // all are received at once
  RelayOptions options;
  options.max_messages_per_s = kPerS;
  StartGuarded(options);
  RawClient& flood = Connect();
  flood.Greet();
  flood.Subscribe("SKEIN_HEARTBEAT");
  MessageSeal mallory = SealOf("mallory");
  const Bytes frames = SignedFrames(kNumFrames, &mallory);
  flood.Send(frames, frames.size());
  step_s_ = 0.04 / kPerS;  // with each look at the clock
  for (int i = 0; i < 2000 && flood.NumHeard() < kNumFrames; ++i) {
    now_s_ += 0.0013;
    Settle();
  }
  EXPECT_EQ(flood.NumHeard(), kNumFrames);
  EXPECT_GT(relay_->counters().num_held_up, 0);
}

// Checking what it says would take all of the relay's time.
TEST_F(RelayLimits, WhoIsRefusedThroughoutIsReadASecondLater) {
  StartGuarded();
  RawClient& listener = Connect();
  listener.Greet();
  listener.Subscribe("SKEIN_HEARTBEAT");
  RawClient& hostile = Connect();
  hostile.Greet();
  hostile.Subscribe("SKEIN_HEARTBEAT");
  for (int i = 0; i < 250; ++i) hostile.Publish("SKEIN_HEARTBEAT", 100);
  const auto num_refused = [&] { return relay_->counters().num_refused; };
  ASSERT_TRUE(Until([&] { return num_refused() == 100; }));
  Settle();
  EXPECT_EQ(num_refused(), 100);

  RawClient& good = Connect();
  good.Greet();
  MessageSeal viewer = SealOf("viewer");
  good.Send(SignedFrame(&viewer));
  EXPECT_TRUE(Until([&] { return listener.NumHeard() == 1 && hostile.NumHeard() == 1; }));

  now_s_ += 1.1;
  EXPECT_TRUE(Until([&] { return num_refused() == 200; }));
  now_s_ += 1.1;
  EXPECT_TRUE(Until([&] { return num_refused() == 250; }));
  EXPECT_EQ(relay_->counters().num_held_up, 2);
  EXPECT_TRUE(hostile.IsOpen());
}

// Nobody hears it, so no signature is checked; yet so many who say so would take all rounds.
TEST_F(RelayLimits, WhoHasNotSignedAndIsHeardByNobodyIsReadASecondLater) {
  StartGuarded();
  RawClient& good = Connect();
  good.Greet();
  good.Subscribe("SKEIN_HEARTBEAT");
  MessageSeal viewer = SealOf("viewer");
  good.Send(SignedFrame(&viewer));
  ASSERT_TRUE(Until([&] { return good.NumHeard() == 1; }));
  for (int i = 0; i < 250; ++i) good.Publish("SKEIN_COMMAND", 100);
  const auto num_messages = [&] { return relay_->counters().num_messages; };
  EXPECT_TRUE(Until([&] { return num_messages() == 251; })) << "it has signed";

  RawClient& hostile = Connect();
  hostile.Greet();
  for (int i = 0; i < 150; ++i) hostile.Publish("SKEIN_COMMAND", 100);
  ASSERT_TRUE(Until([&] { return num_messages() == 351; }));
  Settle();
  EXPECT_EQ(num_messages(), 351);
  now_s_ += 1.1;
  EXPECT_TRUE(Until([&] { return num_messages() == 401; }));
}

TEST_F(RelayLimits, AcceptsManyInARound) {
  Start();
  for (int i = 0; i < 60; ++i) Connect();
  int num_rounds = 0;
  EXPECT_TRUE(Until([&] { return ++num_rounds > 5 || relay_->num_clients() == 60; }));
  EXPECT_EQ(relay_->num_clients(), 60);
}

// By a clock that goes on by 0.1 ms whenever it is asked, as it is for each frame.
TEST_F(RelayLimits, ARoundOfManyFloodsIsNoLongerThanThatOfAFew) {
  constexpr int kNumFloods = 100;
  Start();
  RawClient& good = Join();
  std::vector<RawClient*> floods;
  for (int i = 0; i < kNumFloods; ++i) floods.push_back(&Join());
  Bytes messages;
  const Bytes message = RawClient::Publication("NOBODY", 0);
  while (messages.size() < 60'000) messages.insert(messages.end(), message.begin(), message.end());
  for (const RawClient* flood : floods) flood->Send(messages);
  const int64_t before = relay_->counters().num_messages;
  step_s_ = 1e-4;
  ASSERT_TRUE(Until([&] { return relay_->counters().num_messages > before + 10 * kNumFloods; }));
  const int heard = good.NumHeard();
  const double sent_s = now_s_;
  good.Publish("A", 1);
  ASSERT_TRUE(Until([&] { return good.NumHeard() > heard; }));
  EXPECT_LT(now_s_ - sent_s, 0.1);
}

TEST_F(RelayLimits, AMessageThatDoesNotEndIsWaitedForNotLong) {
  Start();
  RawClient& good = Join();
  RawClient& slow = Join();
  const Bytes message = RawClient::Publication("A", 1000);
  slow.Send(message, 500);
  ASSERT_TRUE(Until([&] { return relay_->held_bytes() > 0; }));
  Settle();
  now_s_ += 9;
  slow.Send(message, 1);  // a byte is no progress
  Settle();
  EXPECT_TRUE(slow.IsOpen());
  now_s_ += 1.6;
  EXPECT_TRUE(Until([&] { return !slow.IsOpen(); }));
  EXPECT_TRUE(good.IsOpen());
}

TEST_F(RelayLimits, AMessageAboveTheLargestIsRefusedAtItsHead) {
  Start();
  RawClient& good = Join();
  RawClient& client = Join();
  Bytes message = RawClient::Publication("A", 0);
  message.resize(message.size() - 4);
  for (const uint8_t byte : {0x00, 0x40, 0x00, 0x01}) message.push_back(byte);  // 4 MiB and 1
  client.Send(message);
  EXPECT_TRUE(Until([&] { return !client.IsOpen(); }));
  EXPECT_EQ(relay_->counters().num_expelled, 1);
  EXPECT_TRUE(good.IsOpen());
}

// 30 messages of 64 MiB that did not end took 1.8 GB.
TEST_F(RelayLimits, UnfinishedMessagesTakeBoundedMemory) {
  RelayOptions options;
  options.memory.max_unfinished_bytes = 4 << 20;
  Start(options);
  RawClient& good = Join();
  size_t most = 0;
  for (int i = 0; i < 30; ++i) {
    RawClient& client = Join();
    client.Send(RawClient::Publication("A", 1 << 20), 300'000);
    const size_t before = relay_->held_bytes();
    ASSERT_TRUE(Until([&] {
      most = std::max(most, relay_->held_bytes());
      return relay_->held_bytes() >= before + 200'000 || relay_->counters().num_expelled > 0;
    }));
    Settle();
  }
  EXPECT_LE(most, options.memory.max_unfinished_bytes);
  EXPECT_GT(relay_->counters().num_expelled, 10);
  const int heard = good.NumHeard();
  good.Publish("A", 30'000);
  EXPECT_TRUE(Until([&] { return good.NumHeard() == heard + 1; }));
}

TEST_F(RelayLimits, WhatItHeldForAMessageGoesWithIt) {
  Start();
  RawClient& client = Join();
  client.Send(RawClient::Publication("B", 1 << 20), 500'000);
  ASSERT_TRUE(Until([&] { return relay_->held_bytes() >= 500'000; }));
  Bytes rest = RawClient::Publication("B", 1 << 20);
  rest.erase(rest.begin(), rest.begin() + 500'000);
  std::thread sender([&] { client.Send(rest); });
  EXPECT_TRUE(Until([&] { return relay_->counters().bytes > (1 << 20); }));
  sender.join();
  Settle();
  EXPECT_LE(relay_->held_bytes(), 400'000u);
}

TEST_F(RelayLimits, ANewClientTakesThePlaceOfTheOldestThatIsSilent) {
  RelayOptions options;
  options.max_clients = 4;
  Start(options);
  RawClient& good = Join();
  std::vector<RawClient*> silent;
  for (const char* from : {"127.0.0.2", "127.0.0.3", "127.0.0.4"}) {
    silent.push_back(&Connect(from));
    const int num = static_cast<int>(silent.size()) + 1;
    ASSERT_TRUE(Until([&] { return relay_->num_clients() == num; }));
    now_s_ += 0.1;
  }
  RawClient& late = Join("127.0.0.5");
  EXPECT_TRUE(Until([&] { return !silent[0]->IsOpen(); }));
  EXPECT_TRUE(silent[1]->IsOpen());
  EXPECT_TRUE(good.IsOpen());
  EXPECT_TRUE(late.IsOpen());
  EXPECT_EQ(relay_->num_clients(), 4);
}

TEST_F(RelayLimits, WhoSpeaksKeepsItsPlace) {
  RelayOptions options;
  options.max_clients = 2;
  Start(options);
  RawClient& speaks = Join();
  RawClient& listens = Join("127.0.0.2");
  RawClient& turned_away = Connect("127.0.0.3");
  EXPECT_TRUE(Until([&] { return !turned_away.IsOpen(); }));
  EXPECT_EQ(relay_->counters().num_turned_away, 1);
  now_s_ += 6;
  const int heard = speaks.NumHeard();
  speaks.Publish("A", 1);
  EXPECT_TRUE(Until([&] { return speaks.NumHeard() == heard + 1; }));
  RawClient& late = Join("127.0.0.4");
  EXPECT_TRUE(Until([&] { return !listens.IsOpen(); }));
  EXPECT_TRUE(speaks.IsOpen());
  EXPECT_TRUE(late.IsOpen());
}

TEST_F(RelayLimits, AnAddressPushesOutItsOwn) {
  RelayOptions options;
  options.max_clients = 8;
  Start(options);
  RawClient& quiet = Join();  // says nothing from now on
  now_s_ += 6;
  std::vector<RawClient*> many;
  for (int i = 0; i < 20; ++i) {
    many.push_back(&Connect("127.0.0.2"));
    const int64_t expelled = std::max(0, i - 3);
    ASSERT_TRUE(Until([&] { return relay_->counters().num_expelled == expelled; }));
    now_s_ += 0.01;
  }
  EXPECT_EQ(relay_->num_clients(), 5);
  EXPECT_TRUE(quiet.IsOpen());
  EXPECT_TRUE(many.back()->IsOpen());
}

TEST_F(RelayLimits, QueuesTakeBoundedMemoryInAll) {
  RelayOptions options;
  options.memory.max_held_bytes = 2 << 20;
  Start(options);
  for (int i = 0; i < 4; ++i) {
    RawClient& deaf = Connect();  // it reads nothing
    deaf.Greet();
    deaf.Subscribe("C" + std::to_string(i));
  }
  RawClient& sender = Join();
  std::thread sending([&] {
    for (int i = 0; i < 400; ++i) sender.Publish("C" + std::to_string(i / 100), 50'000);
  });
  size_t most = 0;
  EXPECT_TRUE(Until([&] {
    most = std::max(most, relay_->held_bytes());
    return relay_->counters().num_messages == 401;
  }));
  sending.join();
  EXPECT_GT(relay_->counters().num_dropped, 0);
  EXPECT_LE(most, options.memory.max_held_bytes + 600'000) << "and a message that is not whole";
}

// Each holds the rest of another large message.
TEST_F(RelayLimits, MessagesThatAreBeingSentTakeBoundedMemoryToo) {
  RelayOptions options;
  options.memory.max_held_bytes = 8 << 20;
  Start(options);
  for (int i = 0; i < 8; ++i) {
    RawClient& deaf = Connect();
    deaf.Greet();
    deaf.Subscribe("C" + std::to_string(i));
  }
  RawClient& sender = Join();
  std::thread sending([&] {
    for (int i = 0; i < 8; ++i) sender.Publish("C" + std::to_string(i), 4'000'000);
  });
  size_t most = 0;
  EXPECT_TRUE(Until([&] {
    most = std::max(most, relay_->held_bytes());
    return relay_->counters().num_messages == 9;
  }));
  sending.join();
  EXPECT_GT(relay_->counters().num_expelled, 0);
  EXPECT_LE(most, options.memory.max_held_bytes + (8 << 20)) << "and a message that is not whole";
  EXPECT_TRUE(sender.IsOpen());
}

// In a process of its own: what it uses is told by its clock.
TEST_F(RelayLimits, NeitherSilentClientsNorLackOfDescriptorsTakesTheProcessor) {
  constexpr int kPort = 7700;
  const Child relay([] {
    const rlimit limit{64, 64};
    ::setrlimit(RLIMIT_NOFILE, &limit);
    PollLoop loop;
    RelayOptions options;
    options.port = kPort;
    Relay own(loop, options);
    loop.Run();
  });
  ASSERT_TRUE(WaitForPort(kPort, kSoonS));
  std::deque<RawClient> silent;
  for (int i = 0; i < 100; ++i) silent.emplace_back(kPort);
  for (const RawClient& each : silent) ASSERT_TRUE(each.connected());
  const auto used_s = [&] {
    clockid_t clock;
    timespec used{};
    ::clock_getcpuclockid(relay.pid(), &clock);
    ::clock_gettime(clock, &used);
    return static_cast<double>(used.tv_sec) + used.tv_nsec * 1e-9;
  };
  const double before_s = used_s();
  const Timer timer;
  RawClient late(kPort);
  late.Greet();
  late.Subscribe("A");
  PollLoop loop;
  loop.AddTimer(0.05, [&] { late.Publish("A", 1); });
  EXPECT_TRUE(loop.RunUntil([&] { return late.NumHeard() > 0; }, kSoonS));
  std::printf("a new client is served after %.3f s\n", timer.ElapsedS());
  loop.RunUntil([] { return false; }, 2 - timer.ElapsedS());
  EXPECT_LT((used_s() - before_s) / timer.ElapsedS(), 0.3) << "share of a core";
}

struct Latencies {
  std::vector<double> ms;
  int num_lost = 0;
};

// Of 200 messages, one every 5 ms or where the loop comes round later, between two links of
// Skein's. `floods`: the receiver also subscribes to channel FLOOD, and handles each of its
// messages for 50 us.
Latencies MeasureLatency(const LcmUrl& url, bool floods) {
  constexpr int kNum = 200;
  PollLoop loop;
  std::vector<double> sent_s(kNum), heard_s(kNum);
  const auto sender = MakeLink(url, loop, [](const std::string&, const Bytes&) {});
  bool is_joined = false;
  const auto receiver = MakeLink(url, loop, [&](const std::string& channel, const Bytes& message) {
    if (channel == "JOIN") is_joined = true;
    if (channel == "FLOOD") {  // as long as checking a signature takes
      for (const Timer timer; timer.ElapsedS() < 50e-6;) continue;
    }
    if (channel != "GOOD" || message.size() != 200) return;
    heard_s[static_cast<size_t>(message[0]) * 256 + message[1]] = MonotonicS();
  });
  for (const char* channel : {"GOOD", "JOIN"}) receiver->Subscribe(channel);
  if (floods) receiver->Subscribe("FLOOD");
  const auto joining = loop.AddTimer(0.02, [&] { sender->Publish("JOIN", "x", 1); });
  EXPECT_TRUE(loop.RunUntil([&] { return is_joined; }, kSoonS));
  loop.CancelTimer(joining);
  int num_sent = 0;
  loop.AddTimer(0.005, [&] {
    if (num_sent == kNum) return;
    Bytes message(200);
    message[0] = static_cast<uint8_t>(num_sent / 256);
    message[1] = static_cast<uint8_t>(num_sent % 256);
    sent_s[static_cast<size_t>(num_sent++)] = MonotonicS();
    sender->Publish("GOOD", message.data(), message.size());
  });
  loop.RunUntil(
      [&] { return num_sent == kNum && std::count(heard_s.begin(), heard_s.end(), 0.0) == 0; }, 20);
  Latencies latencies;
  for (size_t i = 0; i < static_cast<size_t>(num_sent); ++i) {
    if (heard_s[i] == 0) ++latencies.num_lost;
    if (heard_s[i] > 0) latencies.ms.push_back(1e3 * (heard_s[i] - sent_s[i]));
  }
  std::sort(latencies.ms.begin(), latencies.ms.end());
  return latencies;
}

// With one client that sends at full speed, with and without the receiver listening to that, too.
TEST_F(RelayLimits, AFloodLeavesOthersTheirShareMeasured) {
  constexpr int kPort = 7700;
  const LcmUrl url = ParseLcmUrl("tcpq://127.0.0.1:" + std::to_string(kPort));
  for (const size_t flood_bytes : {size_t{0}, size_t{100}, size_t{30'000}, size_t{1'000'000}}) {
    for (const bool floods : {false, true}) {
      const Child relay([] {
        PollLoop loop;
        RelayOptions options;
        options.port = kPort;
        Relay own(loop, options);
        loop.Run();
      });
      ASSERT_TRUE(WaitForPort(kPort, kSoonS));
      std::unique_ptr<Child> hostile;
      if (flood_bytes > 0) {
        hostile = std::make_unique<Child>([flood_bytes] {
          const RawClient client(kPort);
          client.Greet();
          Bytes messages;  // many in one call
          const Bytes message = RawClient::Publication("FLOOD", flood_bytes);
          while (messages.size() < 60'000) {
            messages.insert(messages.end(), message.begin(), message.end());
          }
          while (true) client.Send(messages);
        });
      }
      const Latencies good = MeasureLatency(url, floods);
      ASSERT_FALSE(good.ms.empty()) << "of " << good.num_lost;
      std::printf("flood of %7zu byte messages%s: p50 %.2f ms, p95 %.2f ms, %d of 200 lost\n",
                  flood_bytes, floods ? ", heard by the receiver" : "", good.ms[good.ms.size() / 2],
                  good.ms[good.ms.size() * 95 / 100], good.num_lost);
      std::fflush(stdout);
    }
  }
}

}  // namespace skein::relay_limits_test
