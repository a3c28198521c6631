// TLS 1.3 (RFC 8446) between a session's relay and Skein's clients, by OpenSSL. The client knows
// the relay by its certificate's pin (auth/relay_certificate.h); the relay knows nobody: who says
// what is in the messages.
#pragma once

#include <memory>
#include <string>

#include "auth/relay_certificate.h"
#include "transport/stream.h"

struct ssl_ctx_st;

namespace skein {

class TlsContext {
 public:
  // The relay's side. Throws std::invalid_argument for a certificate that OpenSSL does not take.
  static TlsContext ForRelay(const RelayCertificate& certificate);
  // The client's side. Before it has seen a certificate with the pin it sends no message.
  static TlsContext ForClient(std::string pin);

  // Shakes hands as bytes are sent and received.
  std::unique_ptr<Stream> Wrap(int fd) const;

 private:
  TlsContext(std::shared_ptr<ssl_ctx_st> context, std::string pin);

  std::shared_ptr<ssl_ctx_st> context_;
  std::string pin_;  // "" on the relay's side
};

}  // namespace skein
