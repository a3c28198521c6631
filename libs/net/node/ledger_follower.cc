#include "node/ledger_follower.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "core/log.h"
#include "ledger/ledger_range.h"

namespace skein {
namespace {

constexpr double kRepairPeriodS = 0.02;
// Reordered facts get this long to arrive by themselves.
constexpr double kPatienceS = 0.03;
constexpr double kFirstAskS = 0.2;
constexpr double kLastAskS = 2.0;
// Facts kept beyond a gap; later ones come with the ranges.
constexpr size_t kMaxAhead = 4096;
// A range of one fact may be larger than others.
constexpr int64_t kMaxBlobBytes = kMaxRangeBytes + 2 * kMaxMessageBytes;

}  // namespace

LedgerFollower::LedgerFollower(Node& node, int64_t from_seq, OnFact on_fact)
    : node_(node), on_fact_(std::move(on_fact)), next_seq_(from_seq), ask_interval_s_(kFirstAskS) {
  if (from_seq < 1) throw std::invalid_argument("LedgerFollower: the ledger begins at 1");
  Bus& bus = node_.bus();
  ForEachCommittedChannel([&](auto channel) {
    subscriptions_.push_back(
        bus.Subscribe(channel, [this](const auto& fact) { OnCommitted(fact); }));
  });
  subscriptions_.push_back(bus.Subscribe<ledger_head_t>(
      kLedgerHeadChannel, [this](const ledger_head_t& head) { OnHead(head); }));
  subscriptions_.push_back(bus.Subscribe<ledger_range_t>(
      kLedgerRangeChannel, [this](const ledger_range_t& range) { OnRange(range); }));
  timer_ = node_.loop().AddTimer(kRepairPeriodS, [this] { Repair(); });
}

LedgerFollower::~LedgerFollower() {
  for (const Bus::SubscriptionId id : subscriptions_) node_.bus().Unsubscribe(id);
  node_.loop().CancelTimer(timer_);
  node_.blobs().Cancel(fetch_);
}

void LedgerFollower::OnCommitted(Fact fact) {
  const int64_t seq = Header(fact).seq;
  heard_ = true;
  head_seq_ = std::max(head_seq_, seq);
  if (seq < next_seq_ || (seq > next_seq_ && ahead_.size() >= kMaxAhead)) return;
  ahead_.emplace(seq, std::move(fact));
  DeliverReady();
}

void LedgerFollower::OnHead(const ledger_head_t& head) {
  heard_ = true;
  head_seq_ = std::max(head_seq_, head.head_seq);
}

void LedgerFollower::DeliverReady() {
  if (delivering_) return;  // on_fact_ runs; its caller goes on
  delivering_ = true;
  while (!ahead_.empty() && ahead_.begin()->first == next_seq_) {
    const Fact fact = std::move(ahead_.begin()->second);
    ahead_.erase(ahead_.begin());
    ++next_seq_;
    gap_since_s_ = 0;
    const std::string source = "fact " + Header(fact).fact_id;
    node_.loop().RunNoting(source, [&] { node_.NoteCommitted(fact); });
    node_.loop().RunNoting(source, [&] { on_fact_(fact); });
  }
  delivering_ = false;
}

void LedgerFollower::Repair() {
  if ((heard_ && next_seq_ > head_seq_) || fetch_ != 0) return;
  const double now_s = node_.loop().now_s();
  if (gap_since_s_ == 0) gap_since_s_ = now_s;
  const double patience_s = heard_ ? kPatienceS : 0;
  if (now_s < gap_since_s_ + patience_s || now_s < ask_due_s_) return;
  ledger_request_t request{};
  request.requester = node_.instance();
  request.from_seq = next_seq_;
  request.to_seq = heard_ ? LastMissing() : next_seq_ + kMaxRangeFacts - 1;
  node_.Publish(kLedgerRequestChannel, request);
  ask_due_s_ = now_s + ask_interval_s_;
  ask_interval_s_ = std::min(kLastAskS, 2 * ask_interval_s_);
}

int64_t LedgerFollower::LastMissing() const {
  int64_t seq = head_seq_;
  for (auto fact = ahead_.rbegin(); fact != ahead_.rend() && fact->first == seq; ++fact) --seq;
  return seq;
}

void LedgerFollower::OnRange(const ledger_range_t& range) {
  const bool useful = range.from_seq <= next_seq_ && next_seq_ <= range.to_seq;
  if (range.requester != node_.instance() || !useful || fetch_ != 0) return;
  if (range.size_bytes < 0 || range.size_bytes > kMaxBlobBytes) return;
  // A restarted ingest has no old ranges: ask for the range again, at once.
  const BlobClient::FetchOptions options{kMaxBlobBytes, range.size_bytes, 0};
  fetch_ = node_.blobs().Fetch(
      range.blob_id, "ingest", [this](const Result<Bytes>& bytes) { OnRangeBytes(bytes); },
      options);
}

void LedgerFollower::OnRangeBytes(const Result<Bytes>& bytes) {
  fetch_ = 0;
  if (!bytes) return LogWarn("ledger: {}; asking again", bytes.error());
  Result<std::vector<Fact>> facts = DecodeLedgerRange(*bytes);
  if (!facts) return LogWarn("ledger: {}; asking again", facts.error());
  ask_due_s_ = 0;
  ask_interval_s_ = kFirstAskS;
  for (Fact& fact : *facts) {
    const int64_t seq = Header(fact).seq;
    if (Header(fact).session_id != node_.session_id()) continue;
    head_seq_ = std::max(head_seq_, seq);
    if (seq >= next_seq_) ahead_.insert_or_assign(seq, std::move(fact));
  }
  DeliverReady();
  gap_since_s_ = next_seq_ <= head_seq_ ? node_.loop().now_s() - kPatienceS : 0;
  Repair();
}

}  // namespace skein
