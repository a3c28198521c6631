// Typed publish and subscribe over LCM.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include "auth/message_seal.h"
#include "core/attempt.h"
#include "core/bytes.h"
#include "event_loop/poll_loop.h"
#include "transport/channels.h"
#include "transport/decode.h"
#include "transport/lcm_url.h"
#include "transport/link.h"
#include "transport/roles.h"

namespace skein {

namespace bus_internal {
template <class T>
struct HandlerOf {
  using type = std::function<void(const T&)>;
};
}  // namespace bus_internal

inline constexpr size_t kMaxMessageBytes = 32 << 10;
// Largest message that is sent whole where datagrams leave the host: one Ethernet frame. A trailer
// takes up to kMaxTrailerBytes of it.
inline constexpr size_t kMaxDatagramBytes = 1400;

struct BusCounters {
  int64_t num_received = 0;
  int64_t num_sent = 0;
  int64_t bytes_received = 0;
  int64_t bytes_sent = 0;
  int64_t num_dropped_sends = 0;                   // not connected, or the queue was full
  int64_t num_decode_failures = 0;                 // another type, or damaged
  int64_t num_other_sessions = 0;                  // messages of other sessions
  int64_t num_refused = 0;                         // unsigned, forged, repeated or not allowed
  std::map<std::string, int64_t> decode_failures;  // by channel
  std::map<std::string, int64_t> refused;          // by channel
};

// The main bus and, on the next port, the bus for bulk data. Messages may get lost, doubled and
// reordered. A process hears what it sends. Undecodable messages are counted, logged and dropped;
// messages of another session are dropped, too. With a seal each message is signed, and what
// arrives is held against its signature and against transport/roles.h. Loop's thread only.
class Bus {
 public:
  using SubscriptionId = int64_t;
  // std::function<void(const T&)>; the channel alone decides T, so any callable is taken.
  template <class T>
  using Handler = typename bus_internal::HandlerOf<T>::type;

  // url: see ParseLcmUrl. The loop must outlive the bus. Ignores SIGPIPE from now on.
  Bus(const std::string& url, PollLoop& loop);
  ~Bus();
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  // False if it was dropped on this side; nobody must rely on true. Throws std::length_error for
  // a message above kMaxMessageBytes: bulk data is pulled, not published.
  template <class T>
  bool Publish(const Channel<T>& channel, const T& message) {
    return Publish<T>(std::string(channel.name), message);
  }
  template <class T>
  bool Publish(const std::string& channel, const T& message) {
    return PublishRaw(false, channel, Stamped(message));
  }
  // The handler runs on the loop's thread until Unsubscribe.
  template <class T>
  SubscriptionId Subscribe(const Channel<T>& channel, Handler<T> handler) {
    return Subscribe<T>(std::string(channel.name), std::move(handler));
  }
  template <class T>
  SubscriptionId Subscribe(const std::string& channel, Handler<T> handler) {
    return SubscribeRaw(false, channel, Decoding<T>(channel, std::move(handler)));
  }

  // The same on the bulk bus, which is joined while it has a subscription.
  template <class T>
  bool PublishBulk(const std::string& channel, const T& message) {
    return PublishRaw(true, channel, Stamped(message));
  }
  template <class T>
  SubscriptionId SubscribeBulk(const std::string& channel, std::function<void(const T&)> handler) {
    return SubscribeRaw(true, channel, Decoding<T>(channel, std::move(handler)));
  }

  // No effect if it is gone already. Safe in a handler.
  void Unsubscribe(SubscriptionId id);

  // Sets the session of published messages. Messages of other sessions are dropped from now on (""
  // takes all).
  void SetSession(const std::string& session_id) { session_id_ = session_id; }

  // Signs from now on, and refuses what its sender may not say. takes_unsigned: a message without a
  // signature is taken for what anybody may say. Without a seal all is taken.
  void SetSeal(std::unique_ptr<MessageSeal> seal, bool takes_unsigned);
  // Null if there is none.
  const MessageSeal* seal() const { return seal_.get(); }
  // In a handler: whether the message is signed, as all are without a seal.
  bool IsSigned() const { return sender_ == nullptr || sender_->has_value(); }
  // In a handler: whether the message's sender may be this instance. Without a seal anybody may.
  bool IsFrom(const std::string& instance, bool takes_unsigned) const;
  // In a handler: counts the message as refused; the log tells the reason and the detail.
  void Refuse(const std::string& channel, const char* why, const std::string& detail = "");

  // From now on an exception of a handler refuses its message, unless it is a BrokenState
  // (core/attempt.h). Before, the exception leaves the loop.
  void RefuseWhatThrows() { refuses_what_throws_ = true; }

  const LcmUrl& url() const { return url_; }
  const BusCounters& counters() const { return counters_; }

  // For tests of loss: a received message for which `drop` says true is dropped.
  void SetDropReceived(std::function<bool(const std::string& channel)> drop) {
    drop_received_ = std::move(drop);
  }

 private:
  using RawHandler = std::function<void(const Bytes&)>;
  struct Network {
    std::unique_ptr<Link> link;
    std::map<std::string, std::map<SubscriptionId, std::shared_ptr<RawHandler>>> handlers;
  };

  template <class T>
  Bytes Stamped(const T& message) const {
    if (session_id_.empty() || SessionOf(message) == session_id_) return Encode(message);
    T stamped = message;
    SessionOf(stamped) = session_id_;
    return Encode(stamped);
  }
  template <class T>
  static Bytes Encode(const T& message) {
    Bytes bytes(message.getEncodedSize());
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    return bytes;
  }
  template <class T>
  RawHandler Decoding(std::string channel, std::function<void(const T&)> handler) {
    return [this, channel = std::move(channel), handler = std::move(handler)](const Bytes& bytes) {
      T message;
      if (!DecodeMessage(bytes.data(), bytes.size(), &message)) return CountFailure(channel, bytes);
      if (!session_id_.empty() && SessionOf(message) != session_id_) {
        ++counters_.num_other_sessions;
        return;
      }
      if (sender_ != nullptr) {
        if (const char* why = WhyRefused(*sender_, channel, message)) return Refuse(channel, why);
      }
      Handle(channel, [&] { handler(message); });
    };
  }
  template <class Work>
  void Handle(const std::string& channel, const Work& work) {
    if (!refuses_what_throws_) return work();
    const Status handled = Attempt(work);
    if (!handled.ok()) Refuse(channel, "its handler threw", handled.error());
  }

  bool PublishRaw(bool bulk, const std::string& channel, const Bytes& message);
  SubscriptionId SubscribeRaw(bool bulk, const std::string& channel, RawHandler handler);
  void Deliver(bool bulk, const std::string& channel, const Bytes& message);
  void Open(const std::string& channel, const Bytes& message,
            const std::function<void(const Bytes&)>& then);
  void CountFailure(const std::string& channel, const Bytes& message);
  void CloseBulkWhenIdle();
  void Hello(bool bulk);
  Link& OpenLink(bool bulk);
  Network& network(bool bulk) { return bulk && url_.provider != "memq" ? bulk_ : main_; }

  const LcmUrl url_;
  PollLoop& loop_;
  std::string session_id_;
  Network main_;
  Network bulk_;
  PollLoop::TimerId close_bulk_timer_ = 0;
  PollLoop::TimerId hello_timer_ = 0;
  std::map<SubscriptionId, std::pair<bool, std::string>> subscriptions_;  // bulk?, channel
  SubscriptionId next_id_ = 1;
  BusCounters counters_;
  // By channel and reason, so that no flood hides another.
  std::map<std::pair<std::string, std::string>, int64_t> num_refused_for_;
  std::set<std::string> warned_of_size_;  // channels
  std::unique_ptr<MessageSeal> seal_;
  bool takes_unsigned_ = true;
  // Sender of the message that is handled; null without a seal.
  const Sender* sender_ = nullptr;
  std::function<bool(const std::string&)> drop_received_;
  bool refuses_what_throws_ = false;
};

}  // namespace skein
