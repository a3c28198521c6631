#include "ledger/submitter.h"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <utility>

namespace skein {
namespace {

constexpr double kFirstRepeatS = 0.2;
constexpr double kLastRepeatS = 2.0;
constexpr double kTickS = 0.05;

// None while it is not decided.
std::optional<Submission::State> StateOf(int8_t status) {
  switch (status) {
    case submit_reply_t::COMMITTED:
      return Submission::State::kCommitted;
    case submit_reply_t::REFUSED:
      return Submission::State::kRefused;
    case submit_reply_t::NOT_LEASED:
      return Submission::State::kNotLeased;
    default:
      return std::nullopt;
  }
}

}  // namespace

Submitter::Submitter(PollLoop& loop, Bus& bus, BlobClient& blobs, std::string session_id,
                     std::string instance)
    : loop_(loop),
      bus_(bus),
      blobs_(blobs),
      session_id_(std::move(session_id)),
      instance_(std::move(instance)) {
  reply_subscription_ = bus_.Subscribe<submit_reply_t>(
      kSubmitReplyChannel, [this](const submit_reply_t& reply) { OnReply(reply); });
  timer_ = loop_.AddTimer(kTickS, [this] { SendDue(); });
}

Submitter::~Submitter() {
  bus_.Unsubscribe(reply_subscription_);
  loop_.CancelTimer(timer_);
}

void Submitter::Submit(Fact fact, OnDone on_done) {
  fact_header_t& header = Header(fact);
  if (header.fact_id.empty()) throw std::invalid_argument("Submit: the fact has no fact_id");
  header.session_id = session_id_;
  header.author = instance_;
  header.seq = 0;
  header.utime_us = 0;
  const std::string fact_id = header.fact_id;
  if (const auto known = pending_.find(fact_id); known != pending_.end()) {
    known->second.on_done.push_back(std::move(on_done));
    return;
  }
  Pending pending{std::move(fact), {std::move(on_done)}, kFirstRepeatS, 0};
  Send(&pending);  // one that throws is not repeated
  pending_.emplace(fact_id, std::move(pending));
}

void Submitter::Send(Pending* pending) {
  pending->due_s = loop_.now_s() + pending->interval_s;
  pending->interval_s = std::min(kLastRepeatS, 1.5 * pending->interval_s);
  std::visit(
      [this](const auto& f) {
        bus_.Publish(FactChannels<std::decay_t<decltype(f)>>::submitted, f);
      },
      pending->fact);
}

void Submitter::SendDue() {
  const double now_s = loop_.now_s();
  for (auto& [fact_id, pending] : pending_) {
    if (pending.due_s <= now_s) Send(&pending);
  }
}

void Submitter::OnReply(const submit_reply_t& reply) {
  if (reply.author != instance_) return;
  const std::optional<Submission::State> state = StateOf(reply.status);
  if (state) Finish(reply.fact_id, {*state, reply.seq, reply.reason});
}

void Submitter::OnCommitted(const fact_header_t& header) {
  Finish(header.fact_id, {Submission::State::kCommitted, header.seq, ""});
}

void Submitter::Finish(const std::string& fact_id, const Submission& submission) {
  const auto found = pending_.find(fact_id);
  if (found == pending_.end()) return;
  const Pending pending = std::move(found->second);
  pending_.erase(found);
  for (const std::string& blob : BlobsOf(pending.fact)) blobs_.Release(blob);
  for (const OnDone& on_done : pending.on_done) {
    if (on_done) on_done(submission);
  }
}

}  // namespace skein
