// The live view's server: HTTP/1.1 and WebSockets (Boost.Beast) for readers.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "auth/certificate.h"
#include "auth/web_certificate.h"
#include "core/result.h"
#include "http/event_log.h"
#include "http/guests.h"
#include "http/http.h"

namespace skein {

// A port for visitors with a pass.
struct PublicDoor {
  std::string address;  // to listen on
  int port = 0;
  std::optional<WebCertificate> certificate;  // none: in the clear
};

// Passes, which count on this host by the server's own port, too; and doors for who comes from
// elsewhere.
struct PassAccess {
  std::string host;               // by which visitors from elsewhere know the server; "": none come
  std::vector<PublicDoor> doors;  // none: the own port alone
  SessionTrust trust;             // of the passes
  IsRevoked is_revoked;           // none: no pass is
};

// Bounds of a server's visitors; only tests have narrower ones.
struct WebBounds {
  int max_of_pass = 64;      // connections by one pass
  int max_of_address = 128;  // by the doors, of one address; of IPv6 one network of 64 bits
  double handshake_s = 10;   // of TLS, until it is whole
  double idle_s = 60;      // of a connection: until a request's header is whole, or without taking
                           // a byte
  double body_s = 10;      // of a POST, until its body is whole
  double stalled_s = 30;   // a page that takes nothing for so long is closed
  double gather_s = 0.05;  // events are sent at most so often
};

struct WebServerOptions {
  std::string address = "127.0.0.1";
  int port = 8470;  // 0: a free one
  std::string session_id;
  std::optional<PassAccess> access;  // none: no pass counts
  int max_connections = 64;          // of HTTP and WebSockets together
  WebBounds bounds;

  Status Check() const;
};

struct Uploads {
  SinkMaker make_sink;  // null: nothing is uploaded
  // Name of the agent of a photo; "" where there is none. On the server's thread.
  std::function<std::string(int64_t image_id)> agent_of_photo;
};

// Runs on a thread of its own: a slow or stopped browser holds up nothing else. Every answer comes
// from `handler`, but for those to requests that access.h or the bounds refuse.
//
// A WebSocket gets hello, what TellLatest was last given of each topic, then events as they come. A
// page that does not take its events as fast as they come is told the ledger's head instead, until
// its queue is empty. The page pulls the missing events from /api/events. A connection with a pass
// is closed within two seconds after the pass ends, a WebSocket with the reason (RFC 6455, code
// 1008).
//
// Files of answers are read on further threads: a disk that hangs holds up those who wait for it.
//
// If all places are taken, one connection is closed, the first of these that exists:
//  - the one without a request for longest;
//  - the one whose answer has been due for longest, if for more than idle_s;
//  - if a visitor wants the place: the answer that has been going out for longest, of those to
//    visitors without a pass, of the address with most places, if these are more than one;
//  - the oldest WebSocket of the owner (pass, or else address) with most places, if these are more
//    than one.
// kKeptPlaces stay free for the own port, and as many more for operators.
class WebServer {
 public:
  // `log` outlives the server. Fails where the address cannot be had, with a line for the user;
  // kAlreadyExists: the port is taken.
  static Result<std::unique_ptr<WebServer>> Start(const WebServerOptions& options,
                                                  const EventLog& log, HttpHandler handler,
                                                  Uploads uploads = {});
  // Closes all connections. Handlers that answer later answer nobody.
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  int port() const;
  // Ports of options.access->doors, in their order.
  std::vector<int> door_ports() const;

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
