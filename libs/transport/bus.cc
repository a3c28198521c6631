#include "transport/bus.h"

#include <csignal>
#include <stdexcept>

#include "core/log.h"

namespace skein {
namespace {

// The bulk bus stays joined for a while after its last subscription, because pulls come in groups.
// (A relay sends nothing without subscriptions.)
constexpr double kBulkIdleS = 5.0;

}  // namespace

Bus::Bus(const std::string& url, PollLoop& loop) : url_(ParseLcmUrl(url)), loop_(loop) {
  std::signal(SIGPIPE, SIG_IGN);
  OpenLink(false);
  if (url_.provider == "tcpq") OpenLink(true);  // connecting takes time, being connected none
}

Bus::~Bus() { loop_.CancelTimer(close_bulk_timer_); }

Link& Bus::OpenLink(bool bulk) {
  std::unique_ptr<Link>& link = network(bulk).link;
  if (!link) {
    link = MakeLink(bulk ? url_.Bulk() : url_, loop_,
                    [this, bulk](const std::string& channel, const Bytes& message) {
                      Deliver(bulk, channel, message);
                    });
  }
  return *link;
}

bool Bus::PublishRaw(bool bulk, const std::string& channel, const Bytes& message) {
  if (message.size() > kMaxMessageBytes) {
    throw std::length_error(channel + ": a message of " + std::to_string(message.size()) +
                            " bytes; bulk data is pulled, not published");
  }
  if (url_.leaves_host_by_datagram() && message.size() > kMaxDatagramBytes &&
      warned_of_size_.insert(channel).second) {
    LogWarn("{}: {} bytes leave the host in IP fragments", channel, message.size());
  }
  ++counters_.num_sent;
  counters_.bytes_sent += static_cast<int64_t>(message.size());
  if (OpenLink(bulk).Publish(channel, message.data(), message.size())) return true;
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
  for (const auto& [id, handler] : handlers) {
    if (subscriptions_.count(id)) (*handler)(message);
  }
}

void Bus::CountFailure(const std::string& channel, const Bytes& message) {
  ++counters_.num_decode_failures;
  const int64_t count = ++counters_.decode_failures[channel];
  // Every one of the first, then each power of two: a broken sender repeats itself.
  if (count <= 3 || (count & (count - 1)) == 0) {
    LogWarn("{}: dropped a message of {} bytes that is not of its type ({} so far)", channel,
            message.size(), count);
  }
}

}  // namespace skein
