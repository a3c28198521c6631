#include "relay/relay.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "core/log.h"

namespace skein {
namespace {

// A client's turn: then the others have theirs.
constexpr size_t kTurnReceivedBytes = 64 << 10;
constexpr int kTurnFrames = 256;
constexpr double kTurnS = 0.002;  // checking a signature takes most of it
// Where many have more than a turn's worth their turns are shorter: so long is a round of all.
constexpr double kRoundS = 0.02;
constexpr int kAcceptedAtOnce = 64;

constexpr size_t kSentAtOnce = 64 << 10;
// Of each socket. The kernel's defaults let each client hold megabytes.
constexpr int kSocketBufferBytes = 512 << 10;
// Unsent in the kernel, where no sender's turn counts any more.
constexpr int kUnsentBytes = 64 << 10;

constexpr double kGreetingS = 5;  // a client that has said nothing by then is hung up on
constexpr double kMessageS = 10;  // a client whose message takes longer is hung up on
constexpr double kDeadlineCheckS = 0.5;
constexpr double kIdleS =
    5;  // who has said nothing for so long yields its place where it is wanted
constexpr double kPauseS = 0.5;
// Of one client. What is refused costs it max_messages_per_s / kMaxRefusedPerS messages.
constexpr double kMaxRefusedPerS = 100;
constexpr double kMemberS = 60;  // certificates expire: a hello counts for so long

constexpr char kWatchPort[] = "this port is for listening; publish on the session's URL";

// What a client calls something, for the log.
std::string Shown(const std::string& text) {
  std::string shown = text.substr(0, 64);
  std::replace_if(
      shown.begin(), shown.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return shown;
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
  // What is accepted inherits these.
  SetOption(fd, SOL_SOCKET, SO_RCVBUF, kSocketBufferBytes);
  SetOption(fd, SOL_SOCKET, SO_SNDBUF, kSocketBufferBytes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(loopback ? INADDR_LOOPBACK : INADDR_ANY);
  address.sin_port = htons(static_cast<uint16_t>(port));
  if (::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)) != 0 ||
      ::listen(fd, 128) != 0) {
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

// Small messages leave at once, and a host that vanished is noticed within half a minute.
void ConfigureAccepted(int fd) {
  SetOption(fd, IPPROTO_TCP, TCP_NODELAY, 1);
  SetOption(fd, IPPROTO_TCP, TCP_NOTSENT_LOWAT, kUnsentBytes);
  SetOption(fd, SOL_SOCKET, SO_KEEPALIVE, 1);
  SetOption(fd, IPPROTO_TCP, TCP_KEEPIDLE, 10);
  SetOption(fd, IPPROTO_TCP, TCP_KEEPINTVL, 5);
  SetOption(fd, IPPROTO_TCP, TCP_KEEPCNT, 3);
}

}  // namespace

Relay::Relay(PollLoop& loop, const RelayOptions& options, std::unique_ptr<RelayGuard> guard)
    : loop_(loop), options_(options), guard_(std::move(guard)) {
  AddListener(options.port, options.loopback, false);
  if (options.watch_port) AddListener(*options.watch_port, true, true);
  deadline_timer_ = loop_.AddTimer(kDeadlineCheckS, [this] { ExpelOverdue(); });
}

Relay::~Relay() {
  while (!clients_.empty()) HangUp(clients_.begin()->first, "the relay ends");
  loop_.CancelTimer(deadline_timer_);
  loop_.CancelTimer(late_timer_);
  for (const auto& listener : listeners_) {
    if (listener->pause == 0) loop_.RemoveFd(listener->fd);
    loop_.CancelTimer(listener->pause);
    ::close(listener->fd);
  }
}

void Relay::AddListener(int port, bool loopback, bool is_watch) {
  const int fd = Listen(port, loopback);
  listeners_.push_back(std::make_unique<Listener>(Listener{fd, PortOf(fd), is_watch, 0}));
  Listener* listener = listeners_.back().get();
  loop_.AddFd(fd, [this, listener] { Accept(listener); });
}

// Several at once: who opens connections without end would make others wait for as many rounds.
void Relay::Accept(Listener* listener) {
  for (int i = 0; i < kAcceptedAtOnce && AcceptOne(listener); ++i) continue;
}

// False if nobody more can be accepted for now.
bool Relay::AcceptOne(Listener* listener) {
  sockaddr_in address{};
  socklen_t size = sizeof(address);
  const int fd = ::accept4(listener->fd, reinterpret_cast<sockaddr*>(&address), &size,
                           SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (fd < 0 && (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM)) {
    // It stays readable: without a pause the loop would spin.
    if (!DropIdle(nullptr, "its descriptor is wanted, and it is silent")) PauseAccepting(listener);
    return false;
  }
  if (fd < 0) return false;
  const uint32_t host = ntohl(address.sin_addr.s_addr);
  if (HasRoomFor(host)) {
    Join(*listener, fd, host, NameOf(address));
    return true;
  }
  ::close(fd);
  if (IsWorthALine(++counters_.num_turned_away)) {
    LogWarn("port {}: no room for {}, there are {} clients ({} turned away so far)", listener->port,
            NameOf(address), clients_.size(), counters_.num_turned_away);
  }
  return true;
}

void Relay::PauseAccepting(Listener* listener) {
  LogWarn("port {}: no descriptors are left (ulimit -n); nobody joins for a moment",
          listener->port);
  loop_.RemoveFd(listener->fd);
  listener->pause = loop_.AddOneShot(kPauseS, [this, listener] {
    listener->pause = 0;
    loop_.AddFd(listener->fd, [this, listener] { Accept(listener); });
  });
}

// Drops a silent client where a limit is reached. An address can so push out its own first.
bool Relay::HasRoomFor(uint32_t address) {
  const auto count = num_of_address_.find(address);
  if (count != num_of_address_.end() && count->second >= options_.max_clients / 2 &&
      !DropIdle(&address, "its address has too many connections, and it is silent")) {
    return false;
  }
  return num_clients() < options_.max_clients ||
         DropIdle(nullptr, "its place is wanted, and it is silent");
}

// The one that yields its place: who has not greeted before who is only silent, then of the address
// with most connections, then who has been silent longest. False if there is none.
bool Relay::DropIdle(const uint32_t* address, const char* why) {
  using Rank = std::tuple<bool, int, double>;  // the lowest yields
  auto chosen = clients_.end();
  Rank best;
  for (auto it = clients_.begin(); it != clients_.end(); ++it) {
    const Client& client = it->second;
    if (address != nullptr && client.address != *address) continue;
    const bool greeted = client.parser.greeted();
    if (HasSigned(client) || (greeted && loop_.now_s() - client.heard_s < kIdleS)) continue;
    const Rank rank{greeted, -num_of_address_[client.address], client.heard_s};
    if (chosen != clients_.end() && rank >= best) continue;
    chosen = it;
    best = rank;
  }
  if (chosen == clients_.end()) return false;
  Expel(chosen->first, why);
  return true;
}

void Relay::Join(const Listener& listener, int fd, uint32_t address, std::string name) {
  ConfigureAccepted(fd);
  const bool is_encrypted = options_.tls && !listener.is_watch;
  auto stream = is_encrypted ? options_.tls->Wrap(fd) : std::make_unique<Stream>(fd);
  const auto joined = clients_.emplace(std::piecewise_construct, std::forward_as_tuple(fd),
                                       std::forward_as_tuple(options_, std::move(stream)));
  Client& client = joined.first->second;
  client.id = next_id_++;
  client.address = address;
  client.name = std::move(name);
  client.is_watcher = listener.is_watch;
  client.heard_s = loop_.now_s();
  ++num_of_address_[address];
  LogDebug("{} joins port {}", client.name, listener.port);
  loop_.AddFd(fd, [this, fd] { Serve(fd); });
  tcpq::AppendGreeting(tcpq::kServerMagic, &client.out);
  MarkDirty(fd, &client);
  WriteDirty();
}

// A client's turn.
void Relay::Serve(int fd) {
  Client& client = clients_.at(fd);
  if (client.is_late || client.held_until != 0) return;  // its turn comes without its descriptor
  const size_t before = client.parser.held_bytes();
  const Turn turn = ParseAndReceive(&client);
  unfinished_bytes_ += client.parser.held_bytes();
  unfinished_bytes_ -= before;
  if (turn == Turn::kOver) {
    if (!client.stream->error().empty()) {
      End(fd, *client.stream);
    } else {
      Expel(fd, client.parser.why_broken());
    }
  } else {
    if (turn == Turn::kSpent) HoldUp(fd, &client);
    if (!client.watches_writable) MarkDirty(fd, &client);  // TLS may have waited for what came
  }
  KeepWithinMemory();
  WriteDirty();
}

Relay::Turn Relay::ParseAndReceive(Client* client) {
  uint8_t buffer[kTurnReceivedBytes];
  tcpq::Frame frame;
  size_t received = 0;
  const double start_s = loop_.now_s();
  for (int num_frames = 0;;) {
    if (client->allowance.IsSpent(loop_.now_s())) return Turn::kSpent;
    const auto state = client->parser.Next(&frame);
    if (state == tcpq::FrameParser::State::kBroken) return Turn::kOver;
    if (state == tcpq::FrameParser::State::kFrame) {
      client->heard_s = client->began_s = loop_.now_s();
      Handle(client, frame);
      if (++num_frames < kTurnFrames && loop_.now_s() - start_s < TurnS()) continue;
      ServeLater(client);
      return Turn::kDone;
    }
    if (!client->parser.has_part()) client->began_s = loop_.now_s();
    if (received >= kTurnReceivedBytes) return Turn::kDone;
    const Stream::Moved moved = client->stream->Receive(buffer, sizeof(buffer));
    if (moved.is_over) return Turn::kOver;
    if (moved.bytes == 0) return Turn::kDone;
    received += moved.bytes;
    client->parser.Feed(buffer, moved.bytes);
  }
}

double Relay::TurnS() const { return std::min(kTurnS, kRoundS / (num_late_ + 1)); }

// When the others have had their turn, too.
void Relay::ServeLater(Client* client) {
  client->is_late = true;
  if (late_timer_ != 0) return;
  late_timer_ = loop_.AddOneShot(0, [this] {
    late_timer_ = 0;
    std::vector<int> late;
    for (const auto& [fd, waiting] : clients_) {
      if (waiting.is_late) late.push_back(fd);
    }
    num_late_ = static_cast<int>(late.size());
    for (const int fd : late) {
      const auto waiting = clients_.find(fd);
      if (waiting == clients_.end()) continue;
      waiting->second.is_late = false;
      Serve(fd);
    }
  });
}

// Reads nothing of it for a round. What it hears and has no room for waits as long.
void Relay::HoldUp(int fd, Client* client) {
  if (IsWorthALine(++counters_.num_held_up)) {
    LogWarn(
        "port {}: {} is read slower than it speaks: it says more than {} messages a second, or {} "
        "that are refused or that nobody hears ({} so far)",
        port(), client->name, options_.max_messages_per_s, kMaxRefusedPerS, counters_.num_held_up);
  }
  WatchWritable(fd, client, false);
  loop_.RemoveFd(fd);
  client->held_until = loop_.AddOneShot(kRoundS, [this, fd] {
    clients_.at(fd).held_until = 0;
    loop_.AddFd(fd, [this, fd] { Serve(fd); });
    Serve(fd);
  });
}

void Relay::Handle(Client* client, const tcpq::Frame& frame) {
  if (frame.type == tcpq::FrameType::kPublish) return Publish(client, frame);
  if (frame.type == tcpq::FrameType::kUnsubscribe) return client->channels.Remove(frame.channel);
  const char* why = client->channels.Add(frame.channel);
  if (why != nullptr && IsWorthALine(++counters_.num_refused_subscriptions)) {
    LogWarn("{}: subscription \"{}\" refused: {} ({} refused so far)", client->name,
            Shown(frame.channel), why, counters_.num_refused_subscriptions);
  }
}

void Relay::Publish(Client* from, const tcpq::Frame& frame) {
  ++counters_.num_messages;
  counters_.bytes += static_cast<int64_t>(frame.message.size());
  if (frame.channel == tcpq::kHelloChannel) return HearHello(from, frame.message);
  if (!from->is_watcher && !IsWanted(frame.channel)) return NoteUnheard(from, frame.channel);
  const char* why = WhyRefused(from, frame);
  if (why != nullptr) return NoteRefused(from, frame.channel, why);
  if (guard_ && guard_->IsToCheck(frame.channel)) from->allowance.Spend(1);
  Forward(*from, frame);
}

// A hello alone shows who is at the other end: any other message may be another's, said again.
void Relay::HearHello(Client* from, const Bytes& hello) {
  if (!guard_) return;
  const std::optional<Bytes> binding = from->stream->Binding();
  const char* why = from->is_watcher ? kWatchPort
                    : binding        ? guard_->WhyNoMember(hello, *binding)
                                     : "TLS has no binding for it";
  if (why != nullptr) return NoteRefused(from, tcpq::kHelloChannel, why);
  from->allowance.Spend(1);
  from->member_s = loop_.now_s();
}

void Relay::NoteRefused(Client* from, const std::string& channel, const char* why) {
  ++counters_.num_refused;
  from->allowance.Spend(CostOfRefused());
  const int64_t count = ++num_refused_for_[why];
  if (!IsWorthALine(count)) return;
  LogWarn("{}: a message on {} is not forwarded: {} ({} so far)", from->name, Shown(channel), why,
          count);
}

// No signature is checked. But where all are to sign, and it has not, it has nothing to say, and
// pays as for what is refused.
void Relay::NoteUnheard(Client* from, const std::string& channel) {
  if (!guard_ || !guard_->IsToCheck(channel)) return;
  from->allowance.Spend(guard_->takes_unsigned() || HasSigned(*from) ? 1 : CostOfRefused());
}

double Relay::CostOfRefused() const { return options_.max_messages_per_s / kMaxRefusedPerS; }

bool Relay::IsMember(const Client& client) const {
  return loop_.now_s() - client.member_s < kMemberS;
}

bool Relay::HasSigned(const Client& client) const {
  return loop_.now_s() - std::max(client.member_s, client.signed_s) < kMemberS;
}

bool Relay::Hears(const Client& client, const std::string& channel) const {
  const bool may_hear = !options_.members_only || client.is_watcher || IsMember(client);
  return may_hear && client.channels.Matches(channel);
}

bool Relay::IsWanted(const std::string& channel) const {
  return std::any_of(clients_.begin(), clients_.end(),
                     [&](const auto& client) { return Hears(client.second, channel); });
}

// Null if it is not.
const char* Relay::WhyRefused(Client* from, const tcpq::Frame& frame) {
  if (from->is_watcher) return kWatchPort;
  if (!guard_) return nullptr;
  const RelayGuard::Verdict verdict = guard_->Check(frame.channel, frame.message);
  if (verdict.is_signed) from->signed_s = loop_.now_s();
  return verdict.why_refused;
}

void Relay::Forward(const Client& from, const tcpq::Frame& frame) {
  FairFrameQueue::FramePtr shared;
  for (auto& [fd, client] : clients_) {
    if (!Hears(client, frame.channel)) continue;
    if (!shared) {
      Bytes bytes;
      tcpq::AppendPublish(frame.channel, frame.message.data(), frame.message.size(), &bytes);
      shared = std::make_shared<const SharedFrame>(std::move(bytes), queued_bytes_);
    }
    NoteDropped(&client, client.queue.Push(from.id, shared));
    MarkDirty(fd, &client);
  }
}

void Relay::KeepWithinMemory() {
  while (unfinished_bytes_ > options_.memory.max_unfinished_bytes) {
    const auto largest =
        std::max_element(clients_.begin(), clients_.end(), [](const auto& a, const auto& b) {
          return a.second.parser.held_bytes() < b.second.parser.held_bytes();
        });
    Expel(largest->first, "unfinished messages take too much memory, and most of it is its own");
  }
  while (*queued_bytes_ > options_.memory.max_held_bytes && !clients_.empty()) DropMostQueued();
}

// Clients that stopped at different times hold different messages. What is being sent cannot be
// dropped but with its client.
void Relay::DropMostQueued() {
  const auto waiting = [](const Client& client) {
    return client.queue.bytes() + (client.frame ? client.frame->cost() : 0);
  };
  const auto most = std::max_element(
      clients_.begin(), clients_.end(),
      [&](const auto& a, const auto& b) { return waiting(a.second) < waiting(b.second); });
  if (most->second.queue.empty()) {
    return Expel(most->first, "what waits takes too much memory, and it does not take its own");
  }
  NoteDropped(&most->second, most->second.queue.Clear());
}

void Relay::NoteDropped(Client* client, int64_t num_dropped) {
  if (num_dropped == 0) return;
  counters_.num_dropped += num_dropped;
  const int64_t before = client->num_dropped;
  client->num_dropped += num_dropped;
  if ((before ^ client->num_dropped) <= before) return;  // a line wherever a power of two is passed
  LogWarn("{} does not keep up: {} messages dropped for it", client->name, client->num_dropped);
}

void Relay::MarkDirty(int fd, Client* client) {
  if (client->is_dirty) return;
  client->is_dirty = true;
  dirty_.push_back(fd);
}

void Relay::WriteDirty() {
  for (const int fd : std::exchange(dirty_, {})) {
    const auto client = clients_.find(fd);
    if (client == clients_.end()) continue;
    client->second.is_dirty = false;
    if (client->second.watches_writable) continue;  // it waits for room already
    if (!Write(fd, &client->second)) End(fd, *client->second.stream);
  }
}

// False if the connection has ended.
bool Relay::Write(int fd, Client* client) {
  Bytes& out = client->out;
  while (true) {
    if (client->sent == out.size()) Refill(client);
    if (out.empty()) break;
    const Stream::Moved moved =
        client->stream->Send(out.data() + client->sent, out.size() - client->sent);
    if (moved.is_over) return false;
    if (moved.bytes == 0) break;
    client->sent += moved.bytes;
  }
  WatchWritable(fd, client, client->stream->WaitsForRoom(!out.empty()));
  return true;
}

// With a piece of the frames that wait. A client that stands still holds no more copied.
void Relay::Refill(Client* client) {
  client->out.clear();
  client->sent = 0;
  while (client->out.size() < kSentAtOnce) {
    if (!client->frame) {
      client->frame = client->queue.Pop();
      client->frame_at = 0;
    }
    if (!client->frame) return;
    const Bytes& bytes = client->frame->bytes();
    const size_t size = std::min(kSentAtOnce - client->out.size(), bytes.size() - client->frame_at);
    const auto first = bytes.begin() + static_cast<std::ptrdiff_t>(client->frame_at);
    client->out.insert(client->out.end(), first, first + static_cast<std::ptrdiff_t>(size));
    client->frame_at += size;
    if (client->frame_at == bytes.size()) client->frame.reset();
  }
}

void Relay::WatchWritable(int fd, Client* client, bool watch) {
  if (watch == client->watches_writable || client->held_until != 0) return;
  client->watches_writable = watch;
  if (!watch) return loop_.SetOnWritable(fd, {});
  loop_.SetOnWritable(fd, [this, fd] {
    Client& writable = clients_.at(fd);
    if (!Write(fd, &writable)) return End(fd, *writable.stream);
    if (writable.stream->WaitsForRoom(false)) Serve(fd);
  });
}

void Relay::ExpelOverdue() {
  const double now_s = loop_.now_s();
  std::vector<std::pair<int, const char*>> overdue;
  for (const auto& [fd, client] : clients_) {
    if (client.is_late || client.held_until != 0) continue;
    if (!client.parser.greeted()) {
      if (now_s - client.heard_s >= kGreetingS) overdue.emplace_back(fd, "it says nothing");
    } else if (client.parser.has_part() && now_s - client.began_s >= kMessageS) {
      overdue.emplace_back(fd, "its message does not end");
    }
  }
  for (const auto& [fd, why] : overdue) Expel(fd, why);
}

void Relay::Expel(int fd, const std::string& why) {
  if (IsWorthALine(++counters_.num_expelled)) {
    LogWarn("port {}: hangs up on {}: {} ({} so far)", port(), clients_.at(fd).name, why,
            counters_.num_expelled);
  }
  HangUp(fd, why);
}

// Its connection is over.
void Relay::End(int fd, const Stream& stream) {
  return stream.is_fault() ? Expel(fd, stream.error()) : HangUp(fd, stream.error());
}

void Relay::HangUp(int fd, const std::string& why) {
  const auto client = clients_.find(fd);
  if (client == clients_.end()) return;
  LogDebug("{} leaves port {}: {}", client->second.name, port(), why);
  loop_.CancelTimer(client->second.held_until);
  loop_.RemoveFd(fd);
  unfinished_bytes_ -= client->second.parser.held_bytes();
  const auto count = num_of_address_.find(client->second.address);
  if (--count->second == 0) num_of_address_.erase(count);
  clients_.erase(client);
}

}  // namespace skein
