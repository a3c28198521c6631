#include "transport/roles.h"

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "ledger/facts.h"

namespace skein::roles_test {

const std::vector<Sender> kSenders = {std::nullopt,
                                      Speaker{Role::kIngest, "ingest"},
                                      Speaker{Role::kWorker, "mapper-1"},
                                      Speaker{Role::kAgent, "alice"},
                                      Speaker{Role::kOperator, "chief"},
                                      Speaker{Role::kViewer, "status"},
                                      Speaker{Role::kWeb, "web"}};

// Who may publish on a channel, a letter each, in the order of kSenders: unsigned, ingest, worker,
// agent, operator, viewer, web server (b: browsers).
std::string WhoMay(const std::string& channel) {
  constexpr char kLetters[] = "uiwaovb";
  std::string who;
  for (size_t i = 0; i < kSenders.size(); ++i) {
    if (MayPublish(kSenders[i], channel)) who += kLetters[i];
  }
  return who;
}

TEST(Roles, EachRoleTriesEachChannel) {
  std::map<std::string, std::string> expected = {{"SKEIN_SUBMIT_REPLY", "i"},
                                                 {"SKEIN_IMAGE_OFFER", "uaob"},
                                                 {"SKEIN_IMAGE_ACK", "i"},
                                                 {"SKEIN_PHOTO_DIAGNOSIS", "i"},
                                                 {"SKEIN_LEDGER_HEAD", "i"},
                                                 {"SKEIN_LEDGER_REQUEST", "uiwaovb"},
                                                 {"SKEIN_LEDGER_RANGE", "i"},
                                                 {"SKEIN_WORK_REQUEST", "w"},
                                                 {"SKEIN_WORK", "i"},
                                                 {"SKEIN_WORK_FAILED", "w"},
                                                 {"SKEIN_DEMAND", "iw"},
                                                 {"SKEIN_SUBMAP_STATUS", "w"},
                                                 {"SKEIN_SUBMAP_SHAPE", "w"},
                                                 {"SKEIN_SHAPE_WANTED", "wvb"},
                                                 {"SKEIN_GUIDANCE", "w"},
                                                 {"SKEIN_ADVICE", "w"},
                                                 {"SKEIN_SHARED_REQUEST", "w"},
                                                 {"SKEIN_SHARED_REPLY", "w"},
                                                 {"SKEIN_HEARTBEAT", "iwaovb"},
                                                 {"SKEIN_COMMAND", "ob"},
                                                 {"SKEIN_COMMAND_REPLY", "i"},
                                                 {"SKEIN_BLOB_REQUEST_INGEST", "uiwaovb"},
                                                 {"SKEIN_BLOB_CHUNK_INGEST", "uiwaob"},
                                                 {"SKEIN_NO_SUCH_CHANNEL", ""},
                                                 {"", ""}};
  ForEachCommittedChannel([&](const auto& channel) { expected[channel.name] = "i"; });
  ForEachSubmitChannel([&](const auto& channel) { expected[channel.name] = "w"; });
  EXPECT_EQ(expected.size(), 25u + 2u * kNumFactKinds);
  for (const auto& [channel, who] : expected) EXPECT_EQ(WhoMay(channel), who) << channel;
}

TEST(Roles, ACredentialIsForItsNameAndWhatFollowsADot) {
  const Sender host = Speaker{Role::kWorker, "hostb"};
  EXPECT_TRUE(MayBe(host, "hostb"));
  EXPECT_TRUE(MayBe(host, "hostb.features-1"));
  for (const char* other : {"hostb-1", "hostc", "host", "", "ingest", "agent-x"}) {
    EXPECT_FALSE(MayBe(host, other)) << other;
  }
}

TEST(Roles, AnAgentIsItsOwnInstanceAlone) {
  const Sender alice = Speaker{Role::kAgent, "alice"};
  EXPECT_TRUE(MayBe(alice, AgentInstance("alice")));
  EXPECT_TRUE(MayBe(alice, "agent.alice"));
  EXPECT_FALSE(MayBe(alice, "alice")) << "a process of another role may have that name";
  EXPECT_FALSE(MayBe(alice, AgentInstance("bob")));
  const Sender chief = Speaker{Role::kOperator, "chief"};
  EXPECT_TRUE(MayBe(chief, AgentInstance("chief")));
  EXPECT_TRUE(MayBe(chief, "chief.finish.12"));
  EXPECT_FALSE(MayBe(Speaker{Role::kWorker, "alice"}, AgentInstance("alice")));
}

TEST(Roles, TheWebServerOffersPhotosOfItsAgentsFromItself) {
  const Sender web = Speaker{Role::kWeb, "web"};
  image_offer_t offer{};
  offer.agent = "anna-phone";
  offer.owner = "web";
  EXPECT_EQ(WhyRefused(web, kImageOfferChannel.name, offer), nullptr);
  EXPECT_NE(WhyRefused(Speaker{Role::kViewer, "web"}, kImageOfferChannel.name, offer), nullptr);
  offer.owner = AgentInstance("anna-phone");
  EXPECT_NE(WhyRefused(web, kImageOfferChannel.name, offer), nullptr);
}

TEST(Roles, WithoutASignatureOneMayBeAnAgent) {
  EXPECT_TRUE(MayBe(std::nullopt, AgentInstance("alice")));
  EXPECT_FALSE(MayBe(std::nullopt, "ingest"));
  EXPECT_FALSE(MayBe(std::nullopt, "mapper-1"));
}

TEST(Roles, ChunksAreSentToTheRequesterAlone) {
  const std::string long_name(24, 'n');
  const Sender worker = Speaker{Role::kWorker, long_name};
  EXPECT_TRUE(MayReceiveOn(worker, BlobChunkChannel(long_name)));
  EXPECT_TRUE(MayReceiveOn(worker, BlobChunkChannel(long_name + ".mapper-1-with-more-letters")));
  EXPECT_FALSE(MayReceiveOn(worker, BlobChunkChannel("mapper-1")));
  const Sender alice = Speaker{Role::kAgent, "alice"};
  EXPECT_TRUE(MayReceiveOn(alice, BlobChunkChannel(AgentInstance("alice"))));
  EXPECT_FALSE(MayReceiveOn(alice, BlobChunkChannel("alice")));
  EXPECT_FALSE(MayReceiveOn(alice, BlobChunkChannel("ingest")));
}

template <class T>
T MessageOf(const Channel<T>&) {
  return {};
}

// Each message with a name, by its owner and by another of the same role.
template <class T>
void ExpectBound(const Channel<T>& channel, Role role, const std::string& name, T message) {
  EXPECT_EQ(WhyRefused(Speaker{role, name}, channel.name, message), nullptr) << channel.name;
  EXPECT_STREQ(WhyRefused(Speaker{role, "mallory"}, channel.name, message),
               "it speaks in another's name")
      << channel.name;
}

TEST(Roles, NobodySpeaksInAnothersName) {
  const std::string name = "mapper-1";
  ForEachSubmitChannel([&](const auto& channel) {
    auto fact = MessageOf(channel);
    fact.header.author = name;
    ExpectBound(channel, Role::kWorker, name, fact);
  });
  work_request_t request{};
  request.worker = name;
  ExpectBound(kWorkRequestChannel, Role::kWorker, name, request);
  work_failed_t failed{};
  failed.worker = name;
  ExpectBound(kWorkFailedChannel, Role::kWorker, name, failed);
  demand_t demand{};
  demand.author = name;
  ExpectBound(kDemandChannel, Role::kWorker, name, demand);
  submap_status_t status{};
  status.owner = name;
  ExpectBound(kSubmapStatusChannel, Role::kWorker, name, status);
  submap_shape_t shape{};
  shape.owner = name;
  ExpectBound(kSubmapShapeChannel, Role::kWorker, name, shape);
  shape_wanted_t wanted{};
  wanted.author = name;
  ExpectBound(kShapeWantedChannel, Role::kViewer, name, wanted);
  dense_points_t points{};
  points.author = name;
  ExpectBound(kDensePointsChannel, Role::kWorker, name, points);
  guidance_t guidance{};
  guidance.author = name;
  ExpectBound(kGuidanceChannel, Role::kWorker, name, guidance);
  advice_t advice{};
  advice.author = name;
  ExpectBound(kAdviceChannel, Role::kWorker, name, advice);
  shared_reply_t reply{};
  reply.owner = name;
  ExpectBound(kSharedReplyChannel, Role::kWorker, name, reply);
  heartbeat_t heartbeat{};
  heartbeat.instance = name;
  ExpectBound(kHeartbeatChannel, Role::kViewer, name, heartbeat);
  command_t command{};
  command.sender = name;
  ExpectBound(kCommandChannel, Role::kOperator, name, command);
  ledger_request_t range{};
  range.requester = name;
  ExpectBound(kLedgerRequestChannel, Role::kViewer, name, range);
  blob_request_t blob{};
  blob.reply_channel = BlobChunkChannel(name);
  ExpectBound(Channel<blob_request_t>{"SKEIN_BLOB_REQUEST_INGEST"}, Role::kViewer, name, blob);
  image_offer_t offer{};
  offer.agent = "alice";
  offer.owner = AgentInstance("alice");
  ExpectBound(kImageOfferChannel, Role::kAgent, "alice", offer);
  offer.owner = "mapper-1";
  EXPECT_NE(WhyRefused(Speaker{Role::kAgent, "alice"}, kImageOfferChannel.name, offer), nullptr);
}

TEST(Roles, WithoutASignatureOneMayOfferPhotosAndRead) {
  image_offer_t offer{};
  offer.agent = "alice";
  offer.owner = AgentInstance("alice");
  EXPECT_EQ(WhyRefused(std::nullopt, kImageOfferChannel.name, offer), nullptr);
  offer.owner = "ingest";
  EXPECT_NE(WhyRefused(std::nullopt, kImageOfferChannel.name, offer), nullptr);
  ledger_request_t range{};
  range.requester = "status.1";
  EXPECT_EQ(WhyRefused(std::nullopt, kLedgerRequestChannel.name, range), nullptr);
  EXPECT_STREQ(WhyRefused(std::nullopt, kLedgerHeadChannel.name, ledger_head_t{}),
               "its role may not say so");
  EXPECT_STREQ(WhyRefused(std::nullopt, kCommandChannel.name, command_t{}),
               "its role may not say so");
}

}  // namespace skein::roles_test
