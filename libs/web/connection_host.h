// What a connection of the server asks of it.
#pragma once

#include <cstdint>

#include "web/asio.h"
#include "web/http.h"
#include "web/web_server.h"

namespace skein {

// The server's thread only.
class ConnectionHost {
 public:
  virtual const WebServerOptions& options() const = 0;
  // Has the request answered by HttpConnection::Answer of that connection.
  virtual void Handle(int64_t connection_id, const HttpRequest& request) = 0;
  // The connection goes on as a WebSocket.
  virtual void Upgrade(int64_t connection_id, beast::tcp_stream stream, UpgradeRequest request) = 0;
  virtual void OnClosed(int64_t connection_id) = 0;
  // Of the last event that was sent to the pages.
  virtual int64_t sent_seq() const = 0;

 protected:
  ~ConnectionHost() = default;
};

}  // namespace skein
