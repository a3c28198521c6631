// Visitors with a pass: an operator on this host, and browsers of other hosts by ports of their
// own.
#pragma once

#include <optional>
#include <string>

#include "auth/revocations.h"
#include "auth/web_certificate.h"
#include "http/web_server.h"
#include "node/node.h"
#include "web/session_source.h"
#include "web/web_options.h"

namespace skein {

// Whether a process that runs so can tell who has a pass. An error says what --public-host lacks.
Status CheckVisitors(const NodeOptions& options);

// Any thread.
class Visitors {
 public:
  // `certificate`: of the public port; none: nobody comes from another host.
  Visitors(std::string keys_dir, SessionTrust trust, std::optional<WebCertificate> certificate,
           const WebOptions& options, WatchedRevocations::RunJob run_job);

  const PublicAddresses& addresses() const { return addresses_; }
  void LetIn(WebServerOptions* server) const;
  // To be called once a second: has the list of revoked passes read.
  void Look() { revocations_.Look(); }
  // A new pass as links. `name` "": the role with a number. expires_s: since 1970 UTC; 0: never.
  Result<WebInvitation> Invite(Role role, const std::string& name, int64_t expires_s) const;

 private:
  std::string keys_dir_;
  SessionTrust trust_;
  std::optional<WebCertificate> certificate_;
  std::string host_;
  int public_port_, plain_port_;
  PublicAddresses addresses_;
  WatchedRevocations revocations_;
};

// Files are looked at by jobs, once the session runs. Throws std::runtime_error, with a line for
// the user, without keys or certificate.
Visitors OpenVisitors(const Node& node, const WebOptions& options,
                      WatchedRevocations::RunJob run_job);

}  // namespace skein
