// For tests: a client of the relay that does what it is told, sensible or not.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <string>

#include "core/bytes.h"
#include "transport/tcpq_wire.h"

namespace skein {

class RawClient {
 public:
  // from: the client's own address, on this host.
  explicit RawClient(int port, const char* from = "127.0.0.1") {
    fd_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in own = Address(0);
    ::inet_pton(AF_INET, from, &own.sin_addr);
    sockaddr_in relay = Address(port);
    connected_ = ::bind(fd_, reinterpret_cast<sockaddr*>(&own), sizeof(own)) == 0 &&
                 ::connect(fd_, reinterpret_cast<sockaddr*>(&relay), sizeof(relay)) == 0;
  }
  ~RawClient() { ::close(fd_); }
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;

  bool connected() const { return connected_; }
  void Send(const Bytes& bytes) const { Send(bytes, bytes.size()); }
  // The first `size` bytes of these. Bytes that the relay does not take are left out.
  void Send(const Bytes& bytes, size_t size) const {
    [[maybe_unused]] const ssize_t sent = ::send(fd_, bytes.data(), size, MSG_NOSIGNAL);
  }
  void Greet() const {
    Bytes bytes;
    tcpq::AppendGreeting(tcpq::kClientMagic, &bytes);
    Send(bytes);
  }
  void Subscribe(const std::string& channel) const {
    Bytes bytes;
    tcpq::AppendSubscription(tcpq::FrameType::kSubscribe, channel, &bytes);
    Send(bytes);
  }
  void Publish(const std::string& channel, size_t size) const { Send(Publication(channel, size)); }
  static Bytes Publication(const std::string& channel, size_t size) {
    Bytes bytes;
    tcpq::AppendPublish(channel, Bytes(size, 7).data(), size, &bytes);
    return bytes;
  }
  // Takes what has come. False once the relay has hung up.
  bool IsOpen() {
    uint8_t buffer[65536];
    while (true) {
      const ssize_t got = ::recv(fd_, buffer, sizeof(buffer), MSG_DONTWAIT);
      if (got <= 0) return got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK);
      parser_.Feed(buffer, static_cast<size_t>(got));
      tcpq::Frame frame;
      while (parser_.Next(&frame) == tcpq::FrameParser::State::kFrame) ++num_heard_;
    }
  }
  int NumHeard() {
    IsOpen();
    return num_heard_;
  }

 private:
  static sockaddr_in Address(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<uint16_t>(port));
    return address;
  }

  int fd_ = -1;
  bool connected_ = false;
  tcpq::FrameParser parser_{tcpq::kServerMagic};
  int num_heard_ = 0;
};

}  // namespace skein
