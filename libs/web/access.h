// The one place that decides what a request may have.
#pragma once

#include <optional>
#include <string>

namespace skein {

// What is known of a request before it is looked at.
struct AccessRequest {
  std::string method;                 // "GET"
  std::optional<std::string> host;    // the Host header
  std::optional<std::string> origin;  // the Origin header
  std::string local_address;          // of the server, that the connection came to: "127.0.0.1"
  bool is_websocket = false;
};

struct AccessDecision {
  int status = 0;      // 0: allowed; else that of the answer
  std::string reason;  // a line that says what to do

  bool allowed() const { return status == 0; }
};

// Everyone who reaches the server may read everything. Nobody may write. A request has to name the
// server by the address that it came to, or as localhost: a page of another site that lets its own
// name resolve to this host (DNS rebinding) is refused. A WebSocket is for the server's own page:
// browsers tell a page's origin, other programs tell none.
AccessDecision DecideAccess(const AccessRequest& request);

}  // namespace skein
