// The hub of LCM's tcpq:// transport: forwards every client's messages to every subscribed client.
//
// The relay speaks the protocol of LCM's own relay (class lcm.lcm.TCPService). LCM's relay writes
// to its clients in turn and blocks, so one stopped client stalls all. Skein's never blocks: each
// client has a bounded queue. A message that does not fit is dropped for that client alone, as UDP
// would.
//
// Nothing that a client does is taken on trust: connections, time, memory and turns have limits.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/bytes.h"
#include "event_loop/poll_loop.h"
#include "relay/allowance.h"
#include "relay/channel_set.h"
#include "relay/fair_queue.h"
#include "relay/relay_guard.h"
#include "transport/stream.h"
#include "transport/tcpq_wire.h"
#include "transport/tls.h"

namespace skein {

// Memory of a relay for its clients' messages.
struct RelayMemory {
  size_t max_unfinished_bytes = 32 << 20;  // of all clients' messages that are not whole
  size_t max_held_bytes = 256 << 20;       // in all queues
};

struct RelayOptions {
  int port = 0;           // 0: any, see Relay::port()
  bool loopback = false;  // not reached from other hosts
  RelayMemory memory = {};
  int max_clients = 512;  // connections, half of them from one address at most
  // Rate of one client's messages, and their number at once, if a guard checks their signatures.
  // Beyond the rate the relay reads the client later, so that its connection fills up: nothing is
  // lost.
  double max_messages_per_s = 1000;
  std::optional<TlsContext> tls = {};  // of the port; none: in the clear
  // Messages are forwarded only to clients whose last valid hello is less than 60 s old. Needs a
  // guard.
  bool members_only = false;
  // A second port, in the clear and for this host alone, for LCM's own tools: a client there hears
  // everything, and is not heard. 0: any, see Relay::watch_port().
  std::optional<int> watch_port = {};
};

struct RelayCounters {
  int64_t num_messages = 0;  // received
  int64_t bytes = 0;
  int64_t num_dropped = 0;                // for clients that do not keep up
  int64_t num_refused = 0;                // not forwarded: see RelayGuard; and from the watch port
  int64_t num_refused_subscriptions = 0;  // of a form that is not taken, or too many
  int64_t num_turned_away = 0;            // connections for which there was no room
  int64_t num_held_up = 0;                // clients not read for a moment, as they say too much
  int64_t num_expelled = 0;               // clients hung up on for what they did or did not do
};

// Loop's thread only.
class Relay {
 public:
  // guard: null forwards everything. Throws std::runtime_error if a port cannot be had.
  Relay(PollLoop& loop, const RelayOptions& options, std::unique_ptr<RelayGuard> guard = nullptr);
  ~Relay();
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  int port() const { return listeners_.front()->port; }
  int watch_port() const { return listeners_.back()->port; }
  int num_clients() const { return static_cast<int>(clients_.size()); }
  const RelayCounters& counters() const { return counters_; }
  // Memory of messages that are not whole, and of those that wait to be sent.
  size_t held_bytes() const { return unfinished_bytes_ + *queued_bytes_; }

 private:
  struct Listener {
    int fd = -1;
    int port = 0;
    bool is_watch = false;
    PollLoop::TimerId pause = 0;  // until then nobody is accepted
  };
  static constexpr size_t kMaxQueuedBytes = 8 << 20;  // for one client
  struct Client {
    Client(const RelayOptions& options, std::unique_ptr<Stream> connection)
        : stream(std::move(connection)),
          parser(tcpq::kClientMagic),
          allowance(options.max_messages_per_s),
          queue(kMaxQueuedBytes) {}

    const std::unique_ptr<Stream> stream;
    int64_t id = 0;
    uint32_t address = 0;  // IPv4
    std::string name;      // address:port
    bool is_watcher = false;
    double member_s = -1e9;  // when it last said a hello that holds
    double signed_s = -1e9;  // or something else with a signature that holds
    tcpq::FrameParser parser;
    ChannelSet channels;
    double heard_s = 0;    // when it came, then of its last frame
    double began_s = 0;    // not after the message that is not whole began
    bool is_late = false;  // the client has had its turn, and more of its frames are here
    Allowance allowance;
    PollLoop::TimerId held_until = 0;  // the client is not read until then
    FairFrameQueue queue;
    FairFrameQueue::FramePtr frame;  // being sent
    size_t frame_at = 0;
    Bytes out;  // the next of it, and of what follows
    size_t sent = 0;
    bool is_dirty = false;  // in dirty_
    bool watches_writable = false;
    int64_t num_dropped = 0;
  };
  using Clients = std::map<int, Client>;  // by descriptor

  void AddListener(int port, bool loopback, bool is_watch);
  void Accept(Listener* listener);
  bool AcceptOne(Listener* listener);
  void PauseAccepting(Listener* listener);
  bool HasRoomFor(uint32_t address);
  bool DropIdle(const uint32_t* address, const char* why);
  void Join(const Listener& listener, int fd, uint32_t address, std::string name);

  enum class Turn {
    kDone,   // the client's descriptor, or its next turn, tells of more
    kSpent,  // of its allowance: frames of it may wait that no descriptor tells of
    kOver,   // its connection has ended, or what it says is broken
  };

  void Serve(int fd);
  Turn ParseAndReceive(Client* client);
  double TurnS() const;
  void ServeLater(Client* client);
  void HoldUp(int fd, Client* client);
  void Handle(Client* client, const tcpq::Frame& frame);
  bool IsMember(const Client& client) const;
  bool HasSigned(const Client& client) const;
  bool Hears(const Client& client, const std::string& channel) const;
  bool IsWanted(const std::string& channel) const;
  const char* WhyRefused(Client* from, const tcpq::Frame& frame);
  void Publish(Client* from, const tcpq::Frame& frame);
  void HearHello(Client* from, const Bytes& hello);
  void NoteUnheard(Client* from, const std::string& channel);
  double CostOfRefused() const;
  void NoteRefused(Client* from, const std::string& channel, const char* why);
  void Forward(const Client& from, const tcpq::Frame& frame);
  void KeepWithinMemory();
  void DropMostQueued();
  void NoteDropped(Client* client, int64_t num_dropped);

  void MarkDirty(int fd, Client* client);
  void WriteDirty();
  bool Write(int fd, Client* client);
  static void Refill(Client* client);
  void WatchWritable(int fd, Client* client, bool watch);

  void ExpelOverdue();
  void Expel(int fd, const std::string& why);
  void HangUp(int fd, const std::string& why);
  void End(int fd, const Stream& stream);

  PollLoop& loop_;
  const RelayOptions options_;
  const std::unique_ptr<RelayGuard> guard_;
  std::vector<std::unique_ptr<Listener>>
      listeners_;  // the port, then the watch port if there is one
  Clients clients_;
  std::map<uint32_t, int> num_of_address_;
  int64_t next_id_ = 1;
  size_t unfinished_bytes_ = 0;
  const std::shared_ptr<size_t> queued_bytes_ = std::make_shared<size_t>(0);
  std::vector<int> dirty_;  // have something to send
  PollLoop::TimerId late_timer_ = 0;
  int num_late_ = 0;  // in the last round
  PollLoop::TimerId deadline_timer_ = 0;
  RelayCounters counters_;
  std::map<std::string, int64_t> num_refused_for_;  // by reason, so that no flood hides another
};

}  // namespace skein
