// forger URL SESSION_ID [LINK]: a hostile peer of a session, until it is killed. Says in the names
// of ingest and of workers what would ruin the session, signed by LINK's credential or not at all,
// and says again whatever it hears. Prints "ready forger" when it begins.
#include <cstdint>
#include <cstdio>
#include <deque>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include "core/clock.h"
#include "core/log.h"
#include "ledger/fact_ids.h"
#include "ledger/facts.h"
#include "transport/bus.h"
#include "transport/invitation.h"

namespace skein {
namespace {

constexpr int kMaxPhotos = 64;
constexpr size_t kMaxReplayed = 2000;

class Forger {
 public:
  Forger(PollLoop& loop, const std::string& url, const std::string& session_id)
      : bus_(url, loop),
        link_(MakeLink(
            ParseLcmUrl(url), loop,
            [this](const std::string& channel, const Bytes& message) { Keep(channel, message); })) {
    bus_.SetSession(session_id);
    bus_.Subscribe<image_offer_t>(kImageOfferChannel, [this](const auto& o) { RefusePhoto(o); });
    bus_.Subscribe<heartbeat_t>(kHeartbeatChannel,
                                [this](const auto& h) { DenyBlobsOf(h.instance); });
    bus_.Subscribe<ledger_request_t>(kLedgerRequestChannel, [this](const auto& r) { Mislead(r); });
    const auto record = [this](const auto& channel) { link_->Subscribe(channel.name); };
    ForEachCommittedChannel(record);
    ForEachSubmitChannel(record);
    for (const char* name : {kCommandChannel.name, kWorkRequestChannel.name, kWorkChannel.name,
                             kWorkFailedChannel.name, kSubmitReplyChannel.name}) {
      link_->Subscribe(name);
    }
    loop.AddTimer(0.1, [this] { Forge(); });
    loop.AddTimer(0.02, [this] { Replay(); });
  }

  // Signs as whoever the link is for.
  void SignAs(const Invitation& invitation) {
    bus_.SetSeal(std::make_unique<MessageSeal>(invitation.trust, invitation.credential,
                                               SignerCounters(), NowUs),
                 true);
  }

 private:
  void Forge() {
    ledger_head_t head{};
    head.head_seq = int64_t{1} << 62;
    bus_.Publish(kLedgerHeadChannel, head);
    photo_ = photo_ % kMaxPhotos + 1;
    CommitNonsense();
    for (const char* worker : {"features-1", "matching-1", "mapper-1"}) FailWork(worker);
    for (const char* author : {"features-1", "retrieval", "matching-1", "mapper-1", "merger"}) {
      RefuseSubmissions(author);
    }
    SubmitNonsense();
    Misguide();
    command_t command{};
    command.command_id = photo_;
    command.sender = "finish.1";
    command.verb = "finish";
    command.argument = "1";
    bus_.Publish(kCommandChannel, command);
    command_reply_t reply{};
    reply.command_id = photo_;
    bus_.Publish(kCommandReplyChannel, reply);
  }

  // As ingest: the next facts of the ledger.
  void CommitNonsense() {
    image_t image{};
    image.header.seq = photo_;
    image.header.fact_id = "image/forged";
    image.image_id = photo_;
    bus_.Publish(kImageChannel, image);
    submap_end_t end{};
    end.header.seq = photo_;
    end.submap_id = 1;
    end.reason = "forged";
    bus_.Publish(kSubmapEndChannel, end);
    work_t work{};
    work.worker = "mapper-1";
    work.kind = "submap";
    work.item_id = 1;
    work.epoch = 1'000'000 + photo_;
    bus_.Publish(kWorkChannel, work);
  }

  void FailWork(const std::string& worker) {
    work_failed_t failed{};
    failed.worker = worker;
    failed.kind = worker == "mapper-1" ? "submap" : worker.substr(0, worker.find('-'));
    failed.item_id = photo_;
    failed.reason = "forged";
    failed.permanent = true;
    bus_.Publish(kWorkFailedChannel, failed);
  }

  void RefuseSubmissions(const std::string& author) {
    submit_reply_t reply{};
    reply.author = author;
    reply.status = submit_reply_t::REFUSED;
    reply.reason = "forged";
    for (const std::string& fact_id :
         {FeaturesFactId(photo_), CandidatesFactId(photo_), MatchesFactId(photo_)}) {
      reply.fact_id = fact_id;
      bus_.Publish(kSubmitReplyChannel, reply);
    }
  }

  // As a worker: no pairs for a photo, and the end of a submap.
  void SubmitNonsense() {
    matches_t matches{};
    matches.header.author = "matching-1";
    matches.header.fact_id = MatchesFactId(photo_);
    matches.image_id = photo_;
    bus_.Publish(kSubmitMatchesChannel, matches);
    submap_end_t end{};
    end.header.author = "mapper-1";
    end.header.fact_id = SubmapEndFactId(1);
    end.submap_id = 1;
    end.epoch = 1;
    end.reason = "forged";
    bus_.Publish(kSubmitSubmapEndChannel, end);
  }

  // As the guide: of the first submap, and for the agents of a place.
  void Misguide() {
    guidance_t guidance{};
    guidance.author = "guide";
    guidance.submap_id = 1;
    guidance.place.verdict = completeness_t::COMPLETE;
    guidance.place.sentence = "forged";
    bus_.Publish(kGuidanceChannel, guidance);
    advice_t advice{};
    advice.author = "guide";
    advice.agent = "agent-1";
    advice.submap_id = 1;
    advice.num_stations = 1;
    advice.stations.resize(1);
    advice.stations[0].sentence = "forged";
    bus_.Publish(kAdviceChannel, advice);
  }

  void RefusePhoto(const image_offer_t& offer) {
    image_ack_t ack{};
    ack.agent = offer.agent;
    ack.name = offer.name;
    ack.blob_id = offer.blob_id;
    ack.status = image_ack_t::REFUSED;
    ack.reason = "forged";
    bus_.Publish(kImageAckChannel, ack);
    DenyBlobsOf(offer.owner);
  }

  void DenyBlobsOf(const std::string& owner) {
    if (!denied_owners_.insert(owner).second) return;
    bus_.Subscribe<blob_request_t>(BlobRequestChannel(owner),
                                   [this](const auto& request) { DenyBlob(request); });
  }

  void DenyBlob(const blob_request_t& request) {
    blob_chunk_t chunk{};
    chunk.blob_id = request.blob_id;
    chunk.status = blob_chunk_t::UNKNOWN;
    bus_.PublishBulk(request.reply_channel, chunk);
    chunk.status = blob_chunk_t::OK;
    chunk.total_bytes = int64_t{1} << 40;
    bus_.PublishBulk(request.reply_channel, chunk);
  }

  void Mislead(const ledger_request_t& request) {
    ledger_range_t range{};
    range.requester = request.requester;
    range.from_seq = request.from_seq;
    range.to_seq = request.to_seq;
    range.blob_id = std::string(64, 'a');
    bus_.Publish(kLedgerRangeChannel, range);
  }

  // What it replays comes back, and is kept no second time.
  void Keep(const std::string& channel, const Bytes& message) {
    if (replaying_ || heard_.size() >= kMaxReplayed) return;
    heard_.emplace_back(channel, message);
  }

  void Replay() {
    replaying_ = heard_.size() >= kMaxReplayed;
    if (heard_.empty()) return;
    next_ = (next_ + 1) % heard_.size();
    const auto& [channel, message] = heard_[next_];
    link_->Publish(channel, message.data(), message.size());
  }

  Bus bus_;
  const std::unique_ptr<Link> link_;
  std::set<std::string> denied_owners_;
  std::deque<std::pair<std::string, Bytes>> heard_;
  size_t next_ = 0;
  bool replaying_ = false;
  int64_t photo_ = 0;
};

int Run(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: forger URL SESSION_ID [LINK]\n");
    return 2;
  }
  InitLog("forger", false);
  PollLoop loop;
  Forger forger(loop, argv[1], argv[2]);
  if (argc > 3) {
    const Result<Invitation> invitation = ReadInvitation(argv[3]);
    if (!invitation.ok()) {
      std::fprintf(stderr, "forger: %s\n", invitation.error().c_str());
      return 2;
    }
    forger.SignAs(*invitation);
  }
  std::printf("ready forger\n");
  std::fflush(stdout);
  loop.Run();
  return 0;
}

}  // namespace
}  // namespace skein

int main(int argc, char** argv) { return skein::Run(argc, argv); }
