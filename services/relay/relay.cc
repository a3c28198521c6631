#include "relay/relay.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "core/log.h"

namespace skein {
namespace {

constexpr size_t kMaxPatternBytes = 256;
constexpr size_t kMaxPatterns = 1024;
constexpr size_t kMaxKnownChannels = 4096;
constexpr int kMaxPieces = 64;  // frames written by one system call

bool IsPlain(const std::string& pattern) {
  return std::all_of(pattern.begin(), pattern.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  });
}

// Null if it is no regular expression.
std::shared_ptr<regex_t> Compile(const std::string& pattern) {
  auto regex = std::make_unique<regex_t>();
  const std::string whole = "^(" + pattern + ")$";
  if (::regcomp(regex.get(), whole.c_str(), REG_NOSUB | REG_EXTENDED) != 0) return nullptr;
  return {regex.release(), [](regex_t* compiled) {
            ::regfree(compiled);
            delete compiled;
          }};
}

[[noreturn]] void ThrowSystemError(const std::string& what) {
  throw std::runtime_error(what + ": " + std::strerror(errno));
}

void SetOption(int fd, int level, int name, int value) {
  ::setsockopt(fd, level, name, &value, sizeof(value));
}

int Listen(int port, bool loopback) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0) ThrowSystemError("socket");
  SetOption(fd, SOL_SOCKET, SO_REUSEADDR, 1);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(loopback ? INADDR_LOOPBACK : INADDR_ANY);
  address.sin_port = htons(static_cast<uint16_t>(port));
  if (::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)) != 0 ||
      ::listen(fd, 64) != 0) {
    const int error = errno;
    ::close(fd);
    errno = error;
    ThrowSystemError("cannot listen on port " + std::to_string(port));
  }
  return fd;
}

int PortOf(int fd) {
  sockaddr_in address{};
  socklen_t size = sizeof(address);
  ::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin_port);
}

std::string NameOf(const sockaddr_in& address) {
  char text[INET_ADDRSTRLEN] = {};
  ::inet_ntop(AF_INET, &address.sin_addr, text, sizeof(text));
  return std::string(text) + ":" + std::to_string(ntohs(address.sin_port));
}

}  // namespace

bool ChannelSet::Add(const std::string& pattern) {
  if (pattern.size() > kMaxPatternBytes || patterns_.size() >= kMaxPatterns) return false;
  Pattern added{pattern, nullptr};
  if (!IsPlain(pattern) && !(added.regex = Compile(pattern))) return false;
  patterns_.push_back(std::move(added));
  known_.clear();
  return true;
}

void ChannelSet::Remove(const std::string& pattern) {
  const auto found = std::find_if(patterns_.begin(), patterns_.end(),
                                  [&](const Pattern& p) { return p.text == pattern; });
  if (found == patterns_.end()) return;
  patterns_.erase(found);
  known_.clear();
}

bool ChannelSet::Pattern::Matches(const std::string& channel) const {
  if (!regex) return text == channel;
  return ::regexec(regex.get(), channel.c_str(), 0, nullptr, 0) == 0;
}

bool ChannelSet::Matches(const std::string& channel) {
  const auto known = known_.find(channel);
  if (known != known_.end()) return known->second;
  const bool matches = std::any_of(patterns_.begin(), patterns_.end(),
                                   [&](const Pattern& p) { return p.Matches(channel); });
  if (known_.size() < kMaxKnownChannels) known_[channel] = matches;
  return matches;
}

Relay::Relay(PollLoop& loop, const RelayOptions& options)
    : loop_(loop),
      options_(options),
      listen_fd_(Listen(options.port, options.loopback)),
      port_(PortOf(listen_fd_)) {
  loop_.AddFd(listen_fd_, [this] { Accept(); });
}

Relay::~Relay() {
  while (!clients_.empty()) HangUp(clients_.begin()->first, "the relay ends");
  loop_.RemoveFd(listen_fd_);
  ::close(listen_fd_);
}

void Relay::Accept() {
  sockaddr_in address{};
  socklen_t size = sizeof(address);
  const int fd = ::accept4(listen_fd_, reinterpret_cast<sockaddr*>(&address), &size,
                           SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (fd < 0) return;
  SetOption(fd, IPPROTO_TCP, TCP_NODELAY, 1);
  SetOption(fd, SOL_SOCKET, SO_KEEPALIVE, 1);
  SetOption(fd, IPPROTO_TCP, TCP_KEEPIDLE, 10);
  SetOption(fd, IPPROTO_TCP, TCP_KEEPINTVL, 5);
  SetOption(fd, IPPROTO_TCP, TCP_KEEPCNT, 3);
  Client& client = clients_[fd];
  client.name = NameOf(address);
  LogDebug("{} joins port {}", client.name, port_);
  loop_.AddFd(fd, [this, fd] { Read(fd); });
  Bytes greeting;
  tcpq::AppendGreeting(tcpq::kServerMagic, &greeting);
  Enqueue(fd, &client, std::make_shared<const Bytes>(std::move(greeting)));
  HangUpBroken();
}

void Relay::Read(int fd) {
  uint8_t buffer[65536];
  const ssize_t got = ::recv(fd, buffer, sizeof(buffer), 0);
  if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (got < 0) return HangUp(fd, std::strerror(errno));
  if (got == 0) return HangUp(fd, "it left");
  clients_.at(fd).parser.Feed(buffer, static_cast<size_t>(got));
  if (!HandleFrames(fd)) HangUp(fd, "it speaks another protocol");
  HangUpBroken();
}

void Relay::HangUpBroken() {
  for (const int fd : std::exchange(broken_, {})) HangUp(fd, "it cannot be written to");
}

bool Relay::HandleFrames(int fd) {
  Client& client = clients_.at(fd);
  tcpq::Frame frame;
  while (true) {
    const auto state = client.parser.Next(&frame);
    if (state != tcpq::FrameParser::State::kFrame) {
      return state == tcpq::FrameParser::State::kNeedMore;
    }
    if (frame.type == tcpq::FrameType::kPublish) Forward(frame);
    if (frame.type == tcpq::FrameType::kUnsubscribe) client.channels.Remove(frame.channel);
    if (frame.type == tcpq::FrameType::kSubscribe && !client.channels.Add(frame.channel)) {
      LogWarn("{}: subscription refused: \"{}\"", client.name, frame.channel);
    }
  }
}

void Relay::Forward(const tcpq::Frame& frame) {
  ++counters_.num_messages;
  counters_.bytes += static_cast<int64_t>(frame.message.size());
  FramePtr encoded;
  for (auto& [fd, client] : clients_) {
    if (!client.channels.Matches(frame.channel)) continue;
    if (!encoded) {
      Bytes bytes;
      tcpq::AppendPublish(frame.channel, frame.message.data(), frame.message.size(), &bytes);
      encoded = std::make_shared<const Bytes>(std::move(bytes));
    }
    Enqueue(fd, &client, encoded);
  }
}

void Relay::Enqueue(int fd, Client* client, const FramePtr& frame) {
  if (client->queued_bytes + frame->size() > options_.max_queued_bytes) {
    ++counters_.num_dropped;
    const int64_t count = ++client->num_dropped;
    if ((count & (count - 1)) == 0) {
      LogWarn("{} does not keep up: {} messages dropped for it", client->name, count);
    }
    return;
  }
  client->queue.push_back(frame);
  client->queued_bytes += frame->size();
  if (client->watches_writable) return;  // it waits for room already
  if (!Write(fd, client)) broken_.push_back(fd);
}

bool Relay::Write(int fd, Client* client) {
  while (!client->queue.empty()) {
    iovec pieces[kMaxPieces];
    int count = 0;
    for (const FramePtr& frame : client->queue) {
      const size_t skip = count == 0 ? client->sent_of_first : 0;
      pieces[count++] = {const_cast<uint8_t*>(frame->data()) + skip, frame->size() - skip};
      if (count == kMaxPieces) break;
    }
    msghdr message{};
    message.msg_iov = pieces;
    message.msg_iovlen = static_cast<size_t>(count);
    const ssize_t sent = ::sendmsg(fd, &message, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0 && errno != EAGAIN && errno != EWOULDBLOCK) return false;
    if (sent < 0) break;
    size_t done = client->sent_of_first + static_cast<size_t>(sent);
    while (!client->queue.empty() && done >= client->queue.front()->size()) {
      done -= client->queue.front()->size();
      client->queued_bytes -= client->queue.front()->size();
      client->queue.pop_front();
    }
    client->sent_of_first = done;
  }
  WatchWritable(fd, client, !client->queue.empty());
  return true;
}

void Relay::WatchWritable(int fd, Client* client, bool watch) {
  if (watch == client->watches_writable) return;
  client->watches_writable = watch;
  if (!watch) return loop_.SetOnWritable(fd, {});
  loop_.SetOnWritable(fd, [this, fd] {
    if (!Write(fd, &clients_.at(fd))) HangUp(fd, "it cannot be written to");
  });
}

void Relay::HangUp(int fd, const std::string& why) {
  const auto client = clients_.find(fd);
  if (client == clients_.end()) return;
  LogDebug("{} leaves port {}: {}", client->second.name, port_, why);
  loop_.RemoveFd(fd);
  ::close(fd);
  clients_.erase(client);
}

}  // namespace skein
