#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>

#include "http/asio.h"
#include "http/connection_host.h"

namespace skein {

using SharedText = std::shared_ptr<const std::string>;

// The WebSocket of one page. Bounds of the data that waits for a page: kMaxQueueBytes for its
// events, one message a topic for the rest. The server's thread only; the host outlives it.
class PageSocket : public std::enable_shared_from_this<PageSocket> {
 public:
  PageSocket(ConnectionHost& host, int64_t id, WebStream stream);

  // `latest`: what it is told first, by topic.
  void Start(UpgradeRequest request, std::map<std::string, SharedText> latest);
  // A message of events; null: more than a queue holds.
  void SendEvents(const SharedText& text);
  void SendLatest(const std::string& topic, const SharedText& text);
  void Close();
  // Nothing more is sent but `reason`, of which the page gets the first 123 bytes. Closes the TCP
  // connection when the page has answered, after 0.3 s at most.
  void Refuse(const std::string& reason);

 private:
  void OnAccepted(ErrorCode error);
  void Read();
  // Counts what the page sends, pings and pongs too. False: too much; it is closed.
  bool CountFrame();
  void Pump();
  SharedText NextMessage();
  void WatchWrite();

  ConnectionHost& host_;
  const int64_t id_;
  websocket::stream<WebStream> stream_;
  asio::steady_timer stalled_;
  UpgradeRequest request_;
  beast::flat_buffer buffer_;
  SharedText hello_;
  std::deque<SharedText> events_;
  size_t queued_bytes_ = 0;
  bool behind_ = false;                       // events were left out: it is told the head
  std::map<std::string, SharedText> topics_;  // not sent yet
  SharedText writing_;
  bool open_ = false;
  bool refused_ = false;
  bool closed_ = false;
  int64_t second_ = 0;  // of num_frames_
  int num_frames_ = 0;
};

}  // namespace skein
