// The one place that decides what a request may have.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "http/http.h"

namespace skein {

// Properties of a request that decide about its access.
struct AccessRequest {
  std::string method;                 // "GET"
  std::string path;                   // decoded
  std::optional<std::string> host;    // the Host header
  std::optional<std::string> origin;  // the Origin header
  std::string local_address;          // of the server, that the connection came to: "127.0.0.1"
  std::string public_host;            // a name or address by which others know the server; ""
  bool is_websocket = false;
  bool is_encrypted = false;
  Visitor visitor;
  // Name of the agent of a photo, "" if there is none.
  std::function<std::string(int64_t image_id)> agent_of;
};

struct AccessDecision {
  int status = 0;      // 0: allowed; else that of the answer
  std::string reason;  // a line that says what to do

  bool allowed() const { return status == 0; }
};

// By the server's own port everyone who reaches it may read everything; a visitor of this host may
// also make invitations, and whatever the role of its pass may. By a public port a pass is needed
// for all but the page itself: a viewer reads, an agent sends photos and sees its own, an operator
// does all of that, finishes, invites and reads /metrics.
//
// A request has to name the server by the address that it came to, by public_host, or as localhost:
// a page of another site that lets its own name resolve to this host (DNS rebinding) is refused. A
// WebSocket, and what changes something, is for the server's own page: browsers tell a page's
// origin, other programs tell none.
AccessDecision DecideAccess(const AccessRequest& request);

}  // namespace skein
