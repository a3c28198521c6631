#include "transport/bus.h"

#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <stdexcept>

#include "core/clock.h"
#include "ledger/facts.h"

namespace skein::bus_test {

class BusTest : public testing::Test {
 protected:
  PollLoop loop_;
  Bus bus_{"memq://", loop_};
};

command_t Command(const std::string& session, const std::string& verb) {
  command_t command{};
  command.session_id = session;
  command.verb = verb;
  return command;
}

TEST_F(BusTest, DeliversWhatIsPublished) {
  std::vector<std::string> heard;
  bus_.Subscribe(kCommandChannel, [&](const command_t& c) { heard.push_back(c.verb); });
  bus_.Publish(kCommandChannel, Command("s", "finish"));
  ASSERT_TRUE(loop_.RunUntil([&] { return !heard.empty(); }, 10));
  EXPECT_EQ(heard, std::vector<std::string>{"finish"});
}

TEST_F(BusTest, CountsAndDropsWhatIsOfAnotherTypeOrDamaged) {
  int heard = 0;
  bus_.Subscribe(kCommandChannel, [&](const command_t&) { ++heard; });
  const Channel<work_t> wrong_type{kCommandChannel.name};
  bus_.Publish(wrong_type, work_t{});
  bus_.Publish(kCommandChannel, Command("s", "finish"));
  ASSERT_TRUE(loop_.RunUntil([&] { return heard == 1; }, 10));
  EXPECT_EQ(bus_.counters().num_decode_failures, 1);
  EXPECT_EQ(bus_.counters().decode_failures.at("SKEIN_COMMAND"), 1);
}

TEST_F(BusTest, AnExceptionOfAHandlerLeavesTheLoopUnlessItRefusesTheMessage) {
  int heard = 0;
  bus_.Subscribe(kCommandChannel, [&](const command_t& command) {
    if (command.verb == "throw") throw std::length_error("too long");
    if (command.verb == "break") throw BrokenState("half a fact");
    ++heard;
  });
  const auto publish = [&](const char* verb) { bus_.Publish(kCommandChannel, Command("s", verb)); };
  const auto run = [&] { loop_.RunUntil([&] { return heard > 0; }, 10); };
  publish("throw");
  EXPECT_THROW(run(), std::length_error);
  bus_.RefuseWhatThrows();
  publish("throw");
  publish("finish");
  run();
  EXPECT_EQ(heard, 1);
  EXPECT_EQ(bus_.counters().refused.at(kCommandChannel.name), 1);
  heard = 0;
  publish("break");
  EXPECT_THROW(run(), BrokenState);
}

TEST_F(BusTest, PublishesInItsSession) {
  bus_.SetSession("mine");
  std::string heard;
  bus_.Subscribe(kCommandChannel, [&](const command_t& c) { heard = c.session_id; });
  bus_.Publish(kCommandChannel, Command("", "a"));
  ASSERT_TRUE(loop_.RunUntil([&] { return !heard.empty(); }, 10));
  EXPECT_EQ(heard, "mine");
}

TEST_F(BusTest, CountsAndDropsOtherSessions) {
  std::vector<std::string> heard;
  bus_.Subscribe(kCommandChannel, [&](const command_t& c) { heard.push_back(c.verb); });
  int facts = 0;
  bus_.Subscribe(kSeedChannel, [&](const seed_t&) { ++facts; });
  bus_.Publish(kSeedChannel, seed_t{});
  bus_.Publish(kCommandChannel, Command("other", "a"));
  bus_.SetSession("mine");
  bus_.Publish(kCommandChannel, Command("mine", "b"));
  ASSERT_TRUE(loop_.RunUntil([&] { return !heard.empty(); }, 10));
  EXPECT_EQ(heard, std::vector<std::string>{"b"});
  EXPECT_EQ(facts, 0);
  EXPECT_EQ(bus_.counters().num_other_sessions, 2);
}

TEST_F(BusTest, AHandlerMayUnsubscribeItselfAndOthers) {
  int first = 0, second = 0;
  Bus::SubscriptionId a = 0, b = 0;
  a = bus_.Subscribe(kCommandChannel, [&](const command_t&) {
    ++first;
    bus_.Unsubscribe(a);
    bus_.Unsubscribe(b);
  });
  b = bus_.Subscribe(kCommandChannel, [&](const command_t&) { ++second; });
  int last = 0;
  bus_.Subscribe(kCommandChannel, [&](const command_t&) { ++last; });
  bus_.Publish(kCommandChannel, Command("s", "x"));
  bus_.Publish(kCommandChannel, Command("s", "y"));
  ASSERT_TRUE(loop_.RunUntil([&] { return last == 2; }, 10));
  EXPECT_EQ(first, 1);
  EXPECT_EQ(second, 0);
}

TEST_F(BusTest, RefusesToPublishBulkData) {
  EXPECT_THROW(bus_.Publish(kCommandChannel, Command("s", std::string(40000, 'x'))),
               std::length_error);
}

TEST_F(BusTest, AnExceptionOfAHandlerLeavesTheLoop) {
  bus_.Subscribe(kCommandChannel, [&](const command_t&) { throw std::runtime_error("bug"); });
  bus_.Publish(kCommandChannel, Command("s", "x"));
  EXPECT_THROW(loop_.RunUntil([] { return false; }, 10), std::runtime_error);
}

class SealedBusTest : public BusTest {
 protected:
  void SignAs(Role role, const std::string& name, bool takes_unsigned) {
    const SessionTrust trust{kSession, root_.public_key()};
    bus_.SetSession(kSession);
    bus_.SetSeal(
        std::make_unique<MessageSeal>(trust, IssueCredential(root_, kSession, role, name, 0),
                                      SignerCounters(), NowUs),
        takes_unsigned);
  }
  image_offer_t Offer() {
    image_offer_t offer{};
    offer.session_id = kSession;
    offer.agent = "alice";
    offer.owner = AgentInstance("alice");
    return offer;
  }
  void CountOffersAndCommands() {
    bus_.Subscribe(kImageOfferChannel, [&](const image_offer_t& offer) {
      ++num_offers_;
      is_from_owner_ = bus_.IsFrom(offer.owner, true);
      is_from_owner_and_signed_ = bus_.IsFrom(offer.owner, false);
      is_from_ingest_ = bus_.IsFrom("ingest", true);
    });
    bus_.Subscribe(kCommandChannel, [&](const command_t&) { ++num_commands_; });
  }
  void AwaitRefused(int64_t num) {
    EXPECT_TRUE(loop_.RunUntil([&] { return bus_.counters().num_refused >= num; }, 10));
  }

  static constexpr char kSession[] = "0123456789abcdef";
  const SigningKey root_ = SigningKey::Generate();
  int num_offers_ = 0, num_commands_ = 0;
  bool is_from_owner_ = false, is_from_owner_and_signed_ = true, is_from_ingest_ = true;
};

TEST_F(SealedBusTest, RefusesWhatTheSendersRoleMayNotSay) {
  SignAs(Role::kAgent, "alice", false);
  CountOffersAndCommands();
  bus_.Publish(kImageOfferChannel, Offer());
  command_t command = Command(kSession, "finish");
  command.sender = AgentInstance("alice");
  bus_.Publish(kCommandChannel, command);
  AwaitRefused(1);
  EXPECT_EQ(num_offers_, 1);
  EXPECT_EQ(num_commands_, 0);
  EXPECT_EQ(bus_.counters().refused.at("SKEIN_COMMAND"), 1);
  EXPECT_TRUE(is_from_owner_);
  EXPECT_FALSE(is_from_ingest_);
}

TEST_F(SealedBusTest, TakesOfUnsignedMessagesWhatAnybodyMaySay) {
  CountOffersAndCommands();
  bus_.Publish(kImageOfferChannel, Offer());
  bus_.Publish(kCommandChannel, Command(kSession, "finish"));
  SignAs(Role::kIngest, "ingest", true);
  AwaitRefused(1);
  EXPECT_EQ(num_offers_, 1);
  EXPECT_EQ(num_commands_, 0);
  EXPECT_TRUE(is_from_owner_);
  EXPECT_FALSE(is_from_owner_and_signed_);
}

TEST_F(SealedBusTest, TakesNoUnsignedMessageWhereSignaturesAreRequired) {
  CountOffersAndCommands();
  bus_.Publish(kImageOfferChannel, Offer());
  bus_.Publish(kCommandChannel, Command(kSession, "finish"));
  SignAs(Role::kIngest, "ingest", false);
  AwaitRefused(2);
  EXPECT_EQ(num_offers_, 0);
  EXPECT_EQ(num_commands_, 0);
}

TEST_F(SealedBusTest, WithoutASealATrailerIsCutOff) {
  CountOffersAndCommands();
  SignAs(Role::kAgent, "alice", false);
  bus_.Publish(kImageOfferChannel, Offer());
  bus_.SetSeal(nullptr, true);
  EXPECT_TRUE(loop_.RunUntil([&] { return num_offers_ == 1; }, 10));
  EXPECT_EQ(bus_.counters().num_decode_failures, 0);
}

TEST(Channels, NamesAreWhatLcmTakesLiterally) {
  std::set<std::string> names;
  const auto check = [&](auto channel) {
    const std::string name = channel.name;
    EXPECT_TRUE(names.insert(name).second) << name;
    EXPECT_EQ(name.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_"), std::string::npos);
    EXPECT_LE(name.size(), 63u);
  };
  ForEachCommittedChannel(check);
  ForEachSubmitChannel(check);
  EXPECT_EQ(names.size(), 2u * kNumFactKinds);
  EXPECT_EQ(BlobChunkChannel("hostb-features-1"), "SKEIN_BLOB_CHUNK_HOSTB_FEATURES_1");
  EXPECT_EQ(BlobRequestChannel("agent.anna"), "SKEIN_BLOB_REQUEST_AGENT_ANNA");
  const std::string long_name(64, 'x');
  EXPECT_LE(BlobChunkChannel(long_name).size(), 63u);
  EXPECT_LE(BlobRequestChannel(long_name).size(), 63u);
  EXPECT_NE(BlobChunkChannel(long_name), BlobChunkChannel(std::string(63, 'x')));
}

TEST(Facts, EveryKindHasItsNameAndSurvivesEncoding) {
  for (int kind = 0; kind < kNumFactKinds; ++kind) {
    EXPECT_EQ(FactKindFromName(FactKindName(kind)), kind);
  }
  EXPECT_EQ(FactKindFromName("nonsense"), -1);
  EXPECT_THROW(FactKindName(kNumFactKinds), std::out_of_range);

  Fact fact = failure_t{};
  Header(fact).fact_id = "failure/1";
  const Bytes bytes = EncodeFact(fact);
  const Result<Fact> decoded = DecodeFact(FactKind(fact), bytes.data(), bytes.size());
  ASSERT_TRUE(decoded.ok());
  EXPECT_EQ(Header(*decoded).fact_id, "failure/1");
  EXPECT_FALSE(DecodeFact(0, bytes.data(), bytes.size()).ok());
  EXPECT_FALSE(DecodeFact(-1, bytes.data(), bytes.size()).ok());
  EXPECT_FALSE(DecodeFact(kNumFactKinds, bytes.data(), bytes.size()).ok());
}

TEST(Facts, ListsTheBlobsThatAreSet) {
  features_t features{};
  features.keypoints_blob = "k";
  features.global_blob = "g";
  EXPECT_EQ(BlobsOf(features), (std::vector<std::string>{"k", "g"}));
  EXPECT_TRUE(BlobsOf(seed_t{}).empty());
}

// Largest facts of the default options: 30 verified pairs, clamped reasons, 64-byte instance names.
// Two kinds may be larger, and are then sent in IP fragments: retrieval's default is 200
// candidates, 70 fit; a model tells up to 1,000 outliers, 10 fit.
TEST(Facts, FitOneFrameWhereTheyLeaveTheHost) {
  fact_header_t header{};
  header.session_id = std::string(16, 'a');
  header.author = std::string(64, 'a');
  header.fact_id = std::string(100, 'a');
  candidates_t candidates{};
  candidates.header = header;
  candidates.num_candidates = 70;
  candidates.other_ids.resize(70);
  candidates.distances.resize(70);
  matches_t matches{};
  matches.header = header;
  matches.num_pairs = 30;
  matches.pairs.resize(30);
  matches.pairs_blob = std::string(64, 'a');
  failure_t failure{};
  failure.header = header;
  failure.agent = std::string(64, 'a');
  failure.name = std::string(300, 'a');
  failure.reason = ClampText(std::string(1000, 'a'));
  features_t features{};
  features.header = header;
  for (std::string* blob :
       {&features.keypoints_blob, &features.descriptors_blob, &features.global_blob}) {
    *blob = std::string(64, 'a');
  }
  features.global_model = std::string(64, 'a');
  image_t image{};
  image.header = header;
  image.agent = std::string(64, 'a');
  image.name = std::string(300, 'a');
  image.blob_id = std::string(64, 'a');
  image.num_camera_params = 12;  // FULL_OPENCV
  image.camera_params.resize(12);
  image.camera_model = "FULL_OPENCV";
  submap_model_t model{};
  model.header = header;
  model.model_blob = std::string(64, 'a');
  model.place.sentence = std::string(200, 'a');
  model.georeference.num_outliers = 10;
  model.georeference.outlier_images.resize(10);
  model.georeference.outlier_residuals_m.resize(10);
  for (const Fact& fact : std::vector<Fact>{features, candidates, matches, failure, image, model}) {
    EXPECT_LE(EncodeFact(fact).size() + kMaxTrailerBytes, kMaxDatagramBytes) << FactKindName(fact);
  }
}

TEST(Facts, ClampsTextBetweenCharacters) {
  EXPECT_EQ(ClampText("short"), "short");
  EXPECT_EQ(ClampText("a\xC3\xA9", 2), "a");
  EXPECT_EQ(ClampText("a\xC3\xA9", 3), "a\xC3\xA9");
  EXPECT_EQ(ClampText("a\xC3"
                      "b\xFF"),
            "a?b?")
      << "no UTF-8";
}

TEST(LcmUrl, FillsInDefaultsAndFindsTheBulkBus) {
  const LcmUrl url = ParseLcmUrl("");
  EXPECT_EQ(url.ToString(), "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304");
  EXPECT_EQ(url.Bulk().port, 7668);
  EXPECT_FALSE(url.leaves_host_by_datagram());
  EXPECT_TRUE(ParseLcmUrl("udpm://239.1.1.1:1000?ttl=1").leaves_host_by_datagram());
  EXPECT_EQ(ParseLcmUrl("udpm://?recv_buf_size=1000").recv_buf_size, 1000);
  EXPECT_EQ(ParseLcmUrl("tcpq://host").ToString(), "tcpq://host:7700");
  EXPECT_EQ(ParseLcmUrl("tcpq://").host, "127.0.0.1");
  EXPECT_EQ(ParseLcmUrl("tcpq://host:9").Bulk().ToString(), "tcpq://host:10");
  EXPECT_EQ(ParseLcmUrl("memq://").Bulk().ToString(), "memq://");
}

TEST(LcmUrl, SaysWhatIsWrong) {
  for (const char* url : {"239.255.76.67:7667", "http://x", "udpm://a:b", "udpm://a:70000",
                          "udpm://a:1?ttl=x", "tcpq://host:0"}) {
    EXPECT_THROW(ParseLcmUrl(url), std::invalid_argument) << url;
  }
}

}  // namespace skein::bus_test
