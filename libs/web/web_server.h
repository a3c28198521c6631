// The live view's server: HTTP/1.1 and WebSockets (Boost.Beast) for readers.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "core/result.h"
#include "web/event_log.h"
#include "web/http.h"

namespace skein {

struct WebServerOptions {
  std::string address = "127.0.0.1";
  int port = 8470;  // 0: a free one
  std::string session_id;

  int max_connections = 64;        // of HTTP and WebSockets together
  int max_header_bytes = 8 << 10;  // of a request
  double idle_s = 60;              // of a connection: without a request, or without taking a byte

  int max_frame_bytes = 1 << 10;    // of a message that a page sends
  int max_frames_per_s = 20;        // the same
  int max_queue_bytes = 256 << 10;  // events that wait for one page; beyond, it pulls them itself
  double stalled_s = 30;            // a page that takes nothing for so long is closed
  double gather_s = 0.05;           // events are sent at most so often

  Status Check() const;
};

// Runs on a thread of its own: a slow or stopped browser holds up nothing else. Every answer comes
// from `handler`, but for those to requests that access.h or the bounds refuse.
//
// A WebSocket gets hello, what TellLatest was last given of each topic, then events as they come. A
// page that does not take its events as fast as they come is told the ledger's head instead, until
// its queue is empty. It pulls what it lacks from /api/events.
//
// Where all connections are taken, the one that has been without a request for longest makes room.
class WebServer {
 public:
  // `log` outlives the server. Fails where the address cannot be had, with a line for the user;
  // kAlreadyExists: the port is taken.
  static Result<std::unique_ptr<WebServer>> Start(const WebServerOptions& options,
                                                  const EventLog& log, HttpHandler handler);
  // Closes all connections. Handlers that answer later answer nobody.
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  int port() const;

  // Any thread.
  // The log has grown.
  void NoteEvents();
  // JSON for all pages, newest wins of each topic.
  void TellLatest(const std::string& topic, std::string text);
  // WebSockets that are open.
  int num_viewers() const;
  // Connections of any kind.
  int num_connections() const;

 private:
  class Impl;
  explicit WebServer(std::shared_ptr<Impl> impl);
  const std::shared_ptr<Impl> impl_;
};

}  // namespace skein
