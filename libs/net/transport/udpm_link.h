// udpm://, LCM's multicast of datagrams, without LCM's library, which puts fragments together at
// offsets that it reads from the wire. UdpmLink takes and sends short messages alone, as LCM 1.3.1
// lays them out (lcm/lcm_udpm.c): every LCM tool hears it, and it hears all that Skein sends.
//
//   "LC02", sequence number (uint32, big endian), channel's name, 0, message
#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>

#include "event_loop/alive.h"
#include "transport/link.h"

namespace skein {

struct LcmDatagram {
  std::string channel;
  Bytes message;
};

// nullopt for anything but a short message on a channel with a name of 1 to 63 bytes.
std::optional<LcmDatagram> ParseLcmDatagram(const uint8_t* data, size_t size);
Bytes MakeLcmDatagram(uint32_t sequence_number, const std::string& channel, const void* data,
                      size_t size);

// Datagrams in their order, in bounded memory.
class DatagramQueue {
 public:
  explicit DatagramQueue(size_t max_bytes) : max_bytes_(max_bytes) {}

  // False if there is no room: the datagram is lost.
  bool Push(LcmDatagram datagram);
  // nullopt: there is none.
  std::optional<LcmDatagram> Pop();
  size_t size() const { return datagrams_.size(); }

 private:
  const size_t max_bytes_;
  size_t bytes_ = 0;
  std::deque<LcmDatagram> datagrams_;
};

// A thread of its own empties the socket, whose buffer holds few datagrams. While the loop is busy
// messages on subscribed channels wait for it in 16 MiB of memory; further ones are lost.
class UdpmLink : public Link {
 public:
  // Throws std::runtime_error if the group can be neither joined nor reached.
  UdpmLink(const LcmUrl& url, PollLoop& loop, OnMessage on_message);
  ~UdpmLink() override;
  UdpmLink(const UdpmLink&) = delete;
  UdpmLink& operator=(const UdpmLink&) = delete;

  void Subscribe(const std::string& channel) override;
  void Unsubscribe(const std::string& channel) override;
  bool Publish(const std::string& channel, const void* data, size_t size) override;

 private:
  void Join();
  void Read();
  void Queue(LcmDatagram datagram);
  void Deliver();

  const LcmUrl url_;
  PollLoop& loop_;
  const OnMessage on_message_;
  int send_fd_ = -1;
  int receive_fd_ = -1;  // -1 until the first subscription
  int stop_fd_ = -1;     // eventfd: the reader ends
  uint32_t sequence_number_ = 0;
  std::thread reader_;
  std::mutex mutex_;
  std::set<std::string> channels_;  // guarded by mutex_
  DatagramQueue received_;          // guarded by mutex_
  Alive alive_;
};

}  // namespace skein
