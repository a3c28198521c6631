// The certificate of a session's relays, for TLS: self-signed, known by its fingerprint alone.
//
//   keys/relay.pem   0600; certificate and private key (ECDSA P-256), as OpenSSL writes them
#pragma once

#include <string>

#include "core/bytes.h"
#include "core/result.h"

namespace skein {

// By which a client knows the relay: the first 16 bytes of the SHA-256 of the certificate (DER), as
// base64url, 22 letters. Another certificate of the same pin takes 2^128 tries.
inline constexpr size_t kPinBytes = 16;
std::string CertificatePin(const Bytes& der);
bool IsCertificatePin(const std::string& text);

struct RelayCertificate {
  std::string pem;  // certificate, then private key
  std::string pin;
};

// Makes it where it is missing. `dir` is the folder keys/. An error says which file and what to do.
Result<RelayCertificate> OpenRelayCertificate(const std::string& dir);
// Its pin, for a client on the session's host. Makes nothing.
Result<std::string> ReadRelayPin(const std::string& dir);

}  // namespace skein
