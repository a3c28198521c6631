#include "transport/bus.h"

#include <algorithm>
#include <csignal>
#include <stdexcept>

#include "core/log.h"
#include "transport/tcpq_wire.h"

namespace skein {
namespace {

// The bulk bus stays joined for a while after its last subscription, because pulls come in groups.
// (A relay sends nothing without subscriptions.)
constexpr double kBulkIdleS = 5.0;
// Its relay lets who has said no hello for a minute hear nothing more.
constexpr double kHelloS = 15.0;

}  // namespace

Bus::Bus(const std::string& url, PollLoop& loop) : url_(ParseLcmUrl(url)), loop_(loop) {
  std::signal(SIGPIPE, SIG_IGN);
  OpenLink(false);
  if (url_.goes_over_relay()) OpenLink(true);  // connecting takes time, being connected none
}

Bus::~Bus() {
  loop_.CancelTimer(close_bulk_timer_);
  loop_.CancelTimer(hello_timer_);
}

Link& Bus::OpenLink(bool bulk) {
  std::unique_ptr<Link>& link = network(bulk).link;
  if (!link) {
    link = MakeLink(bulk ? url_.Bulk() : url_, loop_,
                    [this, bulk](const std::string& channel, const Bytes& message) {
                      Deliver(bulk, channel, message);
                    });
    if (url_.provider == "tcpqs") link->SetOnConnected([this, bulk] { Hello(bulk); });
  }
  return *link;
}

bool Bus::PublishRaw(bool bulk, const std::string& channel, const Bytes& message) {
  if (message.size() > kMaxMessageBytes) {
    throw std::length_error(channel + ": a message of " + std::to_string(message.size()) +
                            " bytes; bulk data is pulled, not published");
  }
  const Bytes sealed = seal_ ? seal_->Seal(channel, message) : Bytes();
  const Bytes& sent = seal_ ? sealed : message;
  if (url_.leaves_host_by_datagram() && sent.size() > kMaxDatagramBytes &&
      warned_of_size_.insert(channel).second) {
    LogWarn("{}: {} bytes leave the host in IP fragments", channel, sent.size());
  }
  ++counters_.num_sent;
  counters_.bytes_sent += static_cast<int64_t>(sent.size());
  if (OpenLink(bulk).Publish(channel, sent.data(), sent.size())) return true;
  ++counters_.num_dropped_sends;
  return false;
}

Bus::SubscriptionId Bus::SubscribeRaw(bool bulk, const std::string& channel, RawHandler handler) {
  const SubscriptionId id = next_id_++;
  OpenLink(bulk).Subscribe(channel);
  network(bulk).handlers[channel][id] = std::make_shared<RawHandler>(std::move(handler));
  subscriptions_[id] = {bulk, channel};
  return id;
}

void Bus::Unsubscribe(SubscriptionId id) {
  const auto found = subscriptions_.find(id);
  if (found == subscriptions_.end()) return;
  const auto [bulk, channel] = found->second;
  subscriptions_.erase(found);
  Network& from = network(bulk);
  from.handlers[channel].erase(id);
  if (!from.handlers[channel].empty()) return;
  from.handlers.erase(channel);
  from.link->Unsubscribe(channel);
  if (bulk && url_.provider == "udpm") CloseBulkWhenIdle();
}

void Bus::CloseBulkWhenIdle() {
  loop_.CancelTimer(close_bulk_timer_);
  close_bulk_timer_ = loop_.AddOneShot(kBulkIdleS, [this] {
    if (bulk_.handlers.empty()) bulk_.link.reset();
  });
}

void Bus::Deliver(bool bulk, const std::string& channel, const Bytes& message) {
  ++counters_.num_received;
  counters_.bytes_received += static_cast<int64_t>(message.size());
  if (drop_received_ && drop_received_(channel)) return;
  const auto found = network(bulk).handlers.find(channel);
  if (found == network(bulk).handlers.end()) return;
  const auto handlers = found->second;  // a copy: a handler may unsubscribe
  Open(channel, message, [&](const Bytes& opened) {
    for (const auto& [id, handler] : handlers) {
      if (subscriptions_.count(id)) (*handler)(opened);
    }
  });
}

void Bus::SetSeal(std::unique_ptr<MessageSeal> seal, bool takes_unsigned) {
  seal_ = std::move(seal);
  takes_unsigned_ = takes_unsigned;
  if (url_.provider != "tcpqs") return;
  const auto hello = [this] {
    for (const bool bulk : {false, true}) Hello(bulk);
  };
  hello();
  loop_.CancelTimer(hello_timer_);
  hello_timer_ = loop_.AddTimer(kHelloS, hello);
}

void Bus::Hello(bool bulk) {
  const std::optional<Bytes> binding = OpenLink(bulk).Binding();
  if (!seal_ || !binding) return;
  const Bytes sealed = seal_->Seal(tcpq::kHelloChannel, *binding);
  OpenLink(bulk).Publish(tcpq::kHelloChannel, sealed.data(), sealed.size());
}

// Calls `then` with what is in the message, unless it is refused.
void Bus::Open(const std::string& channel, const Bytes& message,
               const std::function<void(const Bytes&)>& then) {
  OpenedMessage opened;
  Sender sender;
  if (seal_) {
    opened = seal_->Open(channel, message);
    if (opened.kind == OpenedMessage::Kind::kRefused) return Refuse(channel, opened.reason);
    if (opened.kind == OpenedMessage::Kind::kOtherSession) {
      ++counters_.num_other_sessions;
      return;
    }
    if (opened.kind == OpenedMessage::Kind::kSigned) sender = opened.speaker;
    if (!sender && !takes_unsigned_) return Refuse(channel, "it is not signed");
  } else {
    opened.size = SizeWithoutTrailer(message);
  }
  struct Scope {
    explicit Scope(const Sender** place) : place_(place) {}
    ~Scope() { *place_ = nullptr; }
    const Sender** place_;
  } scope(&sender_);
  sender_ = seal_ ? &sender : nullptr;
  if (opened.size == message.size()) return then(message);
  then(Bytes(message.begin(), message.begin() + static_cast<std::ptrdiff_t>(opened.size)));
}

bool Bus::IsFrom(const std::string& instance, bool takes_unsigned) const {
  if (sender_ == nullptr) return true;
  return (IsSigned() || takes_unsigned) && MayBe(*sender_, instance);
}

void Bus::Refuse(const std::string& channel, const char* why, const std::string& detail) {
  ++counters_.num_refused;
  ++counters_.refused[channel];
  const int64_t count = ++num_refused_for_[{channel, why}];
  if (!IsWorthALine(count)) return;
  const std::string by =
      sender_ == nullptr || !*sender_
          ? ""
          : std::string(" by ") + RoleName((*sender_)->role) + " " + (*sender_)->name;
  LogWarn("{}: refused a message{}: {}{} ({} so far)", channel, by, why,
          detail.empty() ? "" : ": " + detail, count);
}

void Bus::CountFailure(const std::string& channel, const Bytes& message) {
  ++counters_.num_decode_failures;
  const int64_t count = ++counters_.decode_failures[channel];
  if (IsWorthALine(count)) {
    LogWarn("{}: dropped a message of {} bytes that is not of its type ({} so far)", channel,
            message.size(), count);
  }
}

}  // namespace skein
