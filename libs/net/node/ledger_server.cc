#include "node/ledger_server.h"

#include <algorithm>
#include <type_traits>

#include "core/clock.h"
#include "ledger/ledger_range.h"

namespace skein {
namespace {

constexpr double kBusyHeadS = 0.1;
constexpr double kIdleHeadS = 1.0;
// Ranges that are remembered; who asks for an older one costs reading it again.
constexpr size_t kMaxMade = 64;

}  // namespace

LedgerServer::LedgerServer(Node& node, int64_t head_seq, ReadRange read_range)
    : node_(node), read_range_(std::move(read_range)), head_seq_(head_seq) {
  subscription_ = node_.bus().Subscribe<ledger_request_t>(
      kLedgerRequestChannel, [this](const ledger_request_t& request) { OnRequest(request); });
  timer_ = node_.loop().AddTimer(kBusyHeadS, [this] { Tick(); });
}

LedgerServer::~LedgerServer() {
  node_.bus().Unsubscribe(subscription_);
  node_.loop().CancelTimer(timer_);
}

void LedgerServer::Broadcast(const Fact& fact) {
  head_seq_ = std::max(head_seq_, Header(fact).seq);
  std::visit(
      [this](const auto& f) {
        node_.bus().Publish(FactChannels<std::decay_t<decltype(f)>>::committed, f);
      },
      fact);
}

void LedgerServer::Tick() {
  const double now_s = node_.loop().now_s();
  const bool busy = in_flight_ > 0 || finishing_;
  if (!busy && now_s < sent_s_ + kIdleHeadS - kBusyHeadS / 2) return;
  SendHead();
}

void LedgerServer::SendHead() {
  sent_s_ = node_.loop().now_s();
  ledger_head_t head{};
  head.head_seq = head_seq_;
  head.utime_us = NowUs();
  head.in_flight = in_flight_;
  node_.Publish(kLedgerHeadChannel, head);
}

void LedgerServer::OnRequest(const ledger_request_t& request) {
  const int64_t from = request.from_seq;
  if (from < 1) return;
  if (from > head_seq_) return SendHead();  // nothing there yet: the requester knows now
  const int64_t to = std::min(request.to_seq, head_seq_);
  if (to < from) return;
  std::optional<ledger_range_t> range;
  if (to - from >= kMaxRangeFacts / 2) {
    const int64_t begin = from - (from - 1) % kMaxRangeFacts;
    range = FindOrMakeRange(begin, std::min(head_seq_, begin + kMaxRangeFacts - 1));
  }
  // A range of large facts may end before what was asked for.
  if (!range || range->to_seq < from) {
    range = FindOrMakeRange(from, std::min(to, from + kMaxRangeFacts - 1));
  }
  if (!range) return;
  range->requester = request.requester;
  node_.Publish(kLedgerRangeChannel, *range);
}

std::optional<ledger_range_t> LedgerServer::FindOrMakeRange(int64_t from_seq, int64_t to_seq) {
  for (const Made& made : made_) {
    const bool fits = made.range.from_seq == from_seq && made.asked_to_seq == to_seq;
    if (fits && node_.blobs().Serves(made.range.blob_id)) return made.range;
  }
  std::optional<ledger_range_t> range = MakeRange(from_seq, to_seq);
  if (range) made_.push_back({to_seq, *range});
  if (made_.size() > kMaxMade) made_.pop_front();
  return range;
}

std::optional<ledger_range_t> LedgerServer::MakeRange(int64_t from_seq, int64_t to_seq) {
  LedgerRangeWriter writer;
  read_range_(from_seq, to_seq, [&writer](int kind, const Bytes& payload) {
    return writer.Add(kind, payload.data(), payload.size());
  });
  if (writer.num_facts() == 0) return std::nullopt;
  ledger_range_t range{};
  range.from_seq = from_seq;
  range.to_seq = from_seq + writer.num_facts() - 1;
  Bytes bytes = writer.Take();
  range.size_bytes = static_cast<int64_t>(bytes.size());
  range.blob_id = node_.blobs().Serve(std::move(bytes));
  return range;
}

}  // namespace skein
