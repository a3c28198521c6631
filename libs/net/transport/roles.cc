#include "transport/roles.h"

#include <map>
#include <string_view>

namespace skein {
namespace {

using RoleSet = unsigned;

constexpr RoleSet Bit(Role role) { return 1u << static_cast<unsigned>(role); }

constexpr RoleSet kUnsigned = 1;
constexpr RoleSet kIngest = Bit(Role::kIngest);
constexpr RoleSet kWorker = Bit(Role::kWorker);
constexpr RoleSet kOperator = Bit(Role::kOperator);
constexpr RoleSet kAgent = Bit(Role::kAgent) | kOperator;
constexpr RoleSet kWeb = Bit(Role::kWeb);
constexpr RoleSet kViewer = Bit(Role::kViewer) | kWeb;
constexpr RoleSet kSigned = kIngest | kWorker | kAgent | kViewer;
constexpr RoleSet kReader = kSigned | kUnsigned;

constexpr RoleSet kMayServeBlobs = kIngest | kWorker | kAgent | kWeb | kUnsigned;

#define SKEIN_FACT_RIGHTS(type, Name, COMMITTED, SUBMITTED) \
  {k##Name##Channel.name, kIngest}, {kSubmit##Name##Channel.name, kWorker},
const std::map<std::string_view, RoleSet> kMayPublish = {
    {kSubmitReplyChannel.name, kIngest},
    {kImageOfferChannel.name, kAgent | kWeb | kUnsigned},
    {kImageAckChannel.name, kIngest},
    {kPhotoDiagnosisChannel.name, kIngest},
    {kLedgerHeadChannel.name, kIngest},
    {kLedgerRequestChannel.name, kReader},
    {kLedgerRangeChannel.name, kIngest},
    {kWorkRequestChannel.name, kWorker},
    {kWorkChannel.name, kIngest},
    {kWorkFailedChannel.name, kWorker},
    {kDemandChannel.name, kIngest | kWorker},
    {kSubmapStatusChannel.name, kWorker},
    {kSubmapShapeChannel.name, kWorker},
    {kShapeWantedChannel.name, kWorker | kViewer},
    {kDensePointsChannel.name, kWorker},
    {kGuidanceChannel.name, kWorker},
    {kAdviceChannel.name, kWorker},
    {kSharedRequestChannel.name, kWorker},
    {kSharedReplyChannel.name, kWorker},
    {kHeartbeatChannel.name, kSigned},
    {kCommandChannel.name, kOperator | kWeb},
    {kCommandReplyChannel.name, kIngest},
    SKEIN_FACT_KINDS(SKEIN_FACT_RIGHTS)};
#undef SKEIN_FACT_RIGHTS

RoleSet RoleOf(const Sender& sender) { return sender ? Bit(sender->role) : kUnsigned; }

bool BeginsWith(std::string_view text, std::string_view beginning) {
  return text.substr(0, beginning.size()) == beginning;
}

RoleSet RolesThatMayPublish(const std::string& channel) {
  if (BeginsWith(channel, kBlobChunkPrefix)) return kMayServeBlobs;
  if (BeginsWith(channel, kBlobRequestPrefix)) return kReader;
  const auto right = kMayPublish.find(channel);
  return right == kMayPublish.end() ? 0 : right->second;
}

// As an agent calls itself.
bool MayBeAgent(const Speaker& speaker) {
  return speaker.role == Role::kAgent || speaker.role == Role::kOperator;
}

}  // namespace

bool MayPublish(const Sender& sender, const std::string& channel) {
  return (RolesThatMayPublish(channel) & RoleOf(sender)) != 0;
}

bool MayBe(const Sender& sender, const std::string& instance) {
  if (!sender) return BeginsWith(instance, "agent");
  const std::string& name = sender->name;
  if (MayBeAgent(*sender) && (instance == AgentInstance(name) || instance == "agent." + name)) {
    return true;
  }
  if (sender->role == Role::kAgent) return false;
  return instance == name || BeginsWith(instance, name + ".");
}

// A channel's name holds the beginning of its instance's, or all of it.
bool MayReceiveOn(const Sender& sender, const std::string& chunk_channel) {
  if (!sender) return true;
  const std::string& name = sender->name;
  if (MayBeAgent(*sender) && (chunk_channel == BlobChunkChannel(AgentInstance(name)) ||
                              chunk_channel == BlobChunkChannel("agent." + name))) {
    return true;
  }
  if (sender->role == Role::kAgent) return false;
  return chunk_channel == BlobChunkChannel(name) ||
         BeginsWith(chunk_channel, BlobChunkChannel((name + ".").substr(0, 24)));
}

}  // namespace skein
