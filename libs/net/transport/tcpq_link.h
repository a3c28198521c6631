// A client of tcpq:// and tcpqs:// that never blocks. LCM's own client blocks in connect, in send
// while the relay is slow, and in receive until a message is whole. This one speaks the same
// protocol, with LCM's relay and Skein's, on the poll loop.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "transport/link.h"
#include "transport/stream.h"
#include "transport/tcpq_wire.h"
#include "transport/tls.h"

namespace skein {

// Connects, to the addresses of the host in turn; after a broken connection connects again after
// 0.1 s, doubling up to 2 s, and subscribes again. Messages are dropped while it is not connected,
// or while 8 MiB wait for a relay that does not read. A relay whose certificate has not the URL's
// pin is as good as absent; the log says why.
class TcpqLink : public Link {
 public:
  // Throws std::invalid_argument for tcpqs without a pin.
  TcpqLink(const LcmUrl& url, PollLoop& loop, OnMessage on_message);
  ~TcpqLink() override;
  TcpqLink(const TcpqLink&) = delete;
  TcpqLink& operator=(const TcpqLink&) = delete;

  void Subscribe(const std::string& channel) override;
  void Unsubscribe(const std::string& channel) override;
  bool Publish(const std::string& channel, const void* data, size_t size) override;
  std::optional<Bytes> Binding() const override;
  void SetOnConnected(std::function<void()> on_connected) override {
    on_connected_ = std::move(on_connected);
  }

 private:
  enum class State { kDisconnected, kConnecting, kConnected };

  void Connect();
  void OnConnected();
  void Disconnect(const std::string& why);
  void Receive();
  void DeliverFrames();
  void Send();
  void TellReached();
  void WatchWritable(bool watch);

  const LcmUrl url_;
  PollLoop& loop_;
  const OnMessage on_message_;
  const std::optional<TlsContext> tls_;  // of tcpqs
  std::set<std::string> channels_;
  std::function<void()> on_connected_;

  State state_ = State::kDisconnected;
  std::unique_ptr<Stream> stream_;  // null while disconnected
  bool is_reached_ = false;         // on_connected_ has been called for this connection
  int num_attempts_ = 0;
  bool watches_writable_ = false;
  bool complained_ = false;  // about this outage
  double retry_s_;
  PollLoop::TimerId retry_timer_ = 0;
  tcpq::FrameParser parser_;
  Bytes out_;
  size_t sent_ = 0;  // bytes of out_
};

}  // namespace skein
