// One connection to one LCM network: raw messages by channel.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/bytes.h"
#include "event_loop/poll_loop.h"
#include "transport/lcm_url.h"

namespace skein {

// Messages that a link delivers before other descriptors and timers have their turn.
inline constexpr int kMaxBatch = 64;

// Loop's thread only. Messages may get lost on any link, and none ever blocks the loop for long.
class Link {
 public:
  using OnMessage = std::function<void(const std::string& channel, const Bytes& message)>;

  virtual ~Link() = default;
  // Idempotent. A link without subscriptions receives nothing.
  virtual void Subscribe(const std::string& channel) = 0;
  virtual void Unsubscribe(const std::string& channel) = 0;
  // False if it was dropped here: not connected, or too much is waiting to be sent.
  virtual bool Publish(const std::string& channel, const void* data, size_t size) = 0;
  // Binding of the connection to the relay (transport/stream.h); nullopt while the relay is not
  // reached.
  virtual std::optional<Bytes> Binding() const { return std::nullopt; }
  // Called whenever a relay is reached: over TLS once both have shaken hands.
  virtual void SetOnConnected(std::function<void()> /*on_connected*/) {}
};

// Calls `on_message` on the loop's thread, outside any call of LCM's library. So it may throw, and
// may end subscriptions, but not the link. Throws std::runtime_error if the transport cannot be set
// up. An absent relay is waited for.
std::unique_ptr<Link> MakeLink(const LcmUrl& url, PollLoop& loop, Link::OnMessage on_message);

}  // namespace skein
