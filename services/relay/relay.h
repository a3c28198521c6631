// The hub of LCM's tcpq:// transport: forwards every client's messages to every subscribed client.
//
// It speaks the protocol of LCM's own relay (class lcm.lcm.TCPService). That relay writes to its
// clients in turn and blocks, so one stopped client stalls all. This one never blocks: each client
// has a bounded queue. What does not fit is dropped for that client alone, as UDP would.
#pragma once

#include <regex.h>

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/bytes.h"
#include "event_loop/poll_loop.h"
#include "transport/tcpq_wire.h"

namespace skein {

// The channels of a client's subscriptions: POSIX extended regular expressions of the whole name,
// as LCM itself uses.
class ChannelSet {
 public:
  // False if it is no regular expression.
  bool Add(const std::string& pattern);
  void Remove(const std::string& pattern);
  bool Matches(const std::string& channel);

 private:
  struct Pattern {
    bool Matches(const std::string& channel) const;

    std::string text;
    std::shared_ptr<regex_t> regex;  // null: the text itself
  };

  std::vector<Pattern> patterns_;
  std::map<std::string, bool> known_;  // answers so far; bounded
};

struct RelayOptions {
  int port = 0;                       // 0: any, see Relay::port()
  size_t max_queued_bytes = 8 << 20;  // for one client
  bool loopback = false;              // not reached from other hosts
};

struct RelayCounters {
  int64_t num_messages = 0;  // received
  int64_t bytes = 0;
  int64_t num_dropped = 0;  // for a client that does not keep up
};

// Loop's thread only.
class Relay {
 public:
  // Throws std::runtime_error if the port cannot be had.
  Relay(PollLoop& loop, const RelayOptions& options);
  ~Relay();
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  int port() const { return port_; }
  int num_clients() const { return static_cast<int>(clients_.size()); }
  const RelayCounters& counters() const { return counters_; }

 private:
  using FramePtr = std::shared_ptr<const Bytes>;
  struct Client {
    Client() : parser(tcpq::kClientMagic) {}
    std::string name;  // address:port
    tcpq::FrameParser parser;
    ChannelSet channels;
    std::deque<FramePtr> queue;
    size_t queued_bytes = 0;
    size_t sent_of_first = 0;
    bool watches_writable = false;
    int64_t num_dropped = 0;
  };

  void Accept();
  void Read(int fd);
  bool HandleFrames(int fd);  // false: the client is to be hung up on
  void Forward(const tcpq::Frame& frame);
  void Enqueue(int fd, Client* client, const FramePtr& frame);
  bool Write(int fd, Client* client);
  void WatchWritable(int fd, Client* client, bool watch);
  void HangUp(int fd, const std::string& why);
  void HangUpBroken();

  PollLoop& loop_;
  const RelayOptions options_;
  int listen_fd_ = -1;
  int port_ = 0;
  std::map<int, Client> clients_;  // by descriptor
  std::vector<int> broken_;        // found while others were served
  RelayCounters counters_;
};

}  // namespace skein
