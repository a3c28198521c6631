// The session that a relay serves: its keys, and the relay's heartbeat in it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "auth/session_keys.h"
#include "node/node.h"
#include "relay/relay.h"
#include "transport/bus.h"

namespace skein {

class RelaySession {
 public:
  // Makes the folder, its keys and, for a tcpqs URL, the certificate where they are missing. Throws
  // std::invalid_argument for options that do not fit, std::runtime_error for a folder that is of
  // no use; both say what to do.
  explicit RelaySession(const NodeOptions& options);

  // nullopt for a URL without TLS.
  std::optional<TlsContext> Tls() const;
  // Whether only who has a credential may hear: over TLS, where signatures are required.
  bool is_closed() const { return certificate_ && auth_ == Auth::kRequire; }
  // A guard for each relay; null if nothing is signed.
  std::unique_ptr<RelayGuard> MakeGuard() const;
  // Tells of the relays once a second from now on, as any process of the session does. The loop and
  // the relays must live as long as this.
  void Speak(PollLoop& loop, const std::vector<std::unique_ptr<Relay>>& relays);

 private:
  MessageSeal MakeSeal() const;
  heartbeat_t Heartbeat(const std::vector<std::unique_ptr<Relay>>& relays) const;

  const std::string instance_;
  LcmUrl url_;
  Auth auth_;
  const std::string keys_dir_;
  SessionAccess access_;
  std::optional<RelayCertificate> certificate_;  // of a tcpqs URL
  std::unique_ptr<Bus> bus_;
};

}  // namespace skein
