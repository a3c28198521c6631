#include "transport/tcpq_link.h"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "core/log.h"

namespace skein {
namespace {

constexpr double kFirstRetryS = 0.1;
constexpr double kLastRetryS = 2.0;
constexpr size_t kMaxWaitingBytes = 8 << 20;

void SetOption(int fd, int level, int name, int value) {
  ::setsockopt(fd, level, name, &value, sizeof(value));
}

// Small messages leave at once, and a host that vanished is noticed within about ten seconds.
void Configure(int fd) {
  SetOption(fd, IPPROTO_TCP, TCP_NODELAY, 1);
  SetOption(fd, SOL_SOCKET, SO_KEEPALIVE, 1);
  SetOption(fd, IPPROTO_TCP, TCP_KEEPIDLE, 4);
  SetOption(fd, IPPROTO_TCP, TCP_KEEPINTVL, 2);
  SetOption(fd, IPPROTO_TCP, TCP_KEEPCNT, 3);
  SetOption(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, 10000);
}

// The `attempt`-th address of the host, in turn: the relay may listen on one of them alone.
const addrinfo* AddressOf(const addrinfo* addresses, int attempt) {
  int count = 0;
  for (const addrinfo* a = addresses; a != nullptr; a = a->ai_next) ++count;
  const addrinfo* address = addresses;
  for (int i = 0; i < attempt % count; ++i) address = address->ai_next;
  return address;
}

// A socket that connects to an address of the host; else -1, with *error.
int StartConnecting(const std::string& host, int port, int attempt, std::string* error) {
  addrinfo hints{}, *addresses = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  const int failure = ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &addresses);
  if (failure != 0) {
    *error = ::gai_strerror(failure);
    return -1;
  }
  const addrinfo* address = AddressOf(addresses, attempt);
  const int fd =
      ::socket(address->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, IPPROTO_TCP);
  int result = -1;
  if (fd >= 0) {
    Configure(fd);
    result = ::connect(fd, address->ai_addr, address->ai_addrlen);
    if (result != 0 && errno == EINPROGRESS) result = 0;
  }
  if (result != 0) {
    *error = std::strerror(errno);
    if (fd >= 0) ::close(fd);
  }
  ::freeaddrinfo(addresses);
  return result == 0 ? fd : -1;
}

int SocketError(int fd) {
  int error = 0;
  socklen_t size = sizeof(error);
  return ::getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size) == 0 ? error : errno;
}

std::optional<TlsContext> TlsOf(const LcmUrl& url) {
  if (url.provider != "tcpqs") return std::nullopt;
  if (url.pin.empty()) {
    throw std::invalid_argument(url.ToString() +
                                ": by what is its relay known? give --session DIR on the session's "
                                "host, --invite LINK elsewhere, or the URL with ?pin=FINGERPRINT");
  }
  return TlsContext::ForClient(url.pin);
}

}  // namespace

TcpqLink::TcpqLink(const LcmUrl& url, PollLoop& loop, OnMessage on_message)
    : url_(url),
      loop_(loop),
      on_message_(std::move(on_message)),
      tls_(TlsOf(url)),
      retry_s_(kFirstRetryS),
      parser_(tcpq::kServerMagic) {
  Connect();
}

TcpqLink::~TcpqLink() {
  loop_.CancelTimer(retry_timer_);
  if (stream_) loop_.RemoveFd(stream_->fd());
}

void TcpqLink::Connect() {
  std::string error;
  const int fd = StartConnecting(url_.host, url_.port, num_attempts_++, &error);
  if (fd < 0) return Disconnect(error);
  stream_ = tls_ ? tls_->Wrap(fd) : std::make_unique<Stream>(fd);
  state_ = State::kConnecting;
  is_reached_ = false;
  watches_writable_ = false;
  parser_ = tcpq::FrameParser(tcpq::kServerMagic);
  loop_.AddFd(fd, [this] { Receive(); });
  WatchWritable(true);
}

void TcpqLink::OnConnected() {
  state_ = State::kConnected;
  out_.clear();
  sent_ = 0;
  tcpq::AppendGreeting(tcpq::kClientMagic, &out_);
  for (const std::string& channel : channels_) {
    tcpq::AppendSubscription(tcpq::FrameType::kSubscribe, channel, &out_);
  }
  Send();
}

void TcpqLink::Disconnect(const std::string& why) {
  if (!complained_) LogWarn("no relay at {}: {}; trying again", url_.ToString(), why);
  complained_ = true;
  if (stream_) loop_.RemoveFd(stream_->fd());
  stream_.reset();
  state_ = State::kDisconnected;
  out_.clear();
  sent_ = 0;
  retry_timer_ = loop_.AddOneShot(retry_s_, [this] { Connect(); });
  retry_s_ = std::min(2 * retry_s_, kLastRetryS);
}

void TcpqLink::Subscribe(const std::string& channel) {
  if (!channels_.insert(channel).second || state_ != State::kConnected) return;
  tcpq::AppendSubscription(tcpq::FrameType::kSubscribe, channel, &out_);
  Send();
}

void TcpqLink::Unsubscribe(const std::string& channel) {
  if (channels_.erase(channel) == 0 || state_ != State::kConnected) return;
  tcpq::AppendSubscription(tcpq::FrameType::kUnsubscribe, channel, &out_);
  Send();
}

bool TcpqLink::Publish(const std::string& channel, const void* data, size_t size) {
  if (state_ != State::kConnected || out_.size() - sent_ > kMaxWaitingBytes) return false;
  tcpq::AppendPublish(channel, data, size, &out_);
  Send();
  return state_ == State::kConnected;
}

void TcpqLink::Send() {
  while (sent_ < out_.size()) {
    const Stream::Moved moved = stream_->Send(out_.data() + sent_, out_.size() - sent_);
    if (moved.is_over) return Disconnect(stream_->error());
    if (moved.bytes == 0) break;
    sent_ += moved.bytes;
  }
  if (sent_ == out_.size() || sent_ > (1 << 20)) {
    out_.erase(out_.begin(), out_.begin() + static_cast<std::ptrdiff_t>(sent_));
    sent_ = 0;
  }
  WatchWritable(stream_->WaitsForRoom(!out_.empty()));
  TellReached();
}

std::optional<Bytes> TcpqLink::Binding() const {
  return state_ == State::kConnected ? stream_->Binding() : std::nullopt;
}

void TcpqLink::TellReached() {
  if (is_reached_ || !Binding()) return;
  is_reached_ = true;
  if (on_connected_) on_connected_();
}

void TcpqLink::WatchWritable(bool watch) {
  if (watch == watches_writable_) return;
  watches_writable_ = watch;
  if (!watch) return loop_.SetOnWritable(stream_->fd(), {});
  loop_.SetOnWritable(stream_->fd(), [this] {
    if (state_ == State::kConnected) return stream_->WaitsForRoom(false) ? Receive() : Send();
    const int error = SocketError(stream_->fd());
    if (error != 0) return Disconnect(std::strerror(error));
    OnConnected();
  });
}

void TcpqLink::Receive() {
  // A connection that fails is told of as readable, too.
  if (state_ == State::kConnecting) {
    const int error = SocketError(stream_->fd());
    return error != 0 ? Disconnect(std::strerror(error)) : OnConnected();
  }
  uint8_t buffer[65536];
  const Stream::Moved moved = stream_->Receive(buffer, sizeof(buffer));
  if (moved.is_over) return Disconnect(stream_->error());
  if (moved.bytes > 0) {
    if (complained_) LogInfo("relay at {} is back", url_.ToString());
    complained_ = false;
    retry_s_ = kFirstRetryS;
    parser_.Feed(buffer, moved.bytes);
    DeliverFrames();
  }
  // TLS may have waited for what came.
  if (stream_ && !watches_writable_) Send();
}

void TcpqLink::DeliverFrames() {
  tcpq::Frame frame;
  while (stream_) {
    const auto state = parser_.Next(&frame);
    if (state == tcpq::FrameParser::State::kNeedMore) return;
    if (state == tcpq::FrameParser::State::kBroken) return Disconnect(parser_.why_broken());
    // Not in the set: the relay sent it before it got the unsubscription.
    if (channels_.count(frame.channel)) on_message_(frame.channel, frame.message);
  }
}

}  // namespace skein
