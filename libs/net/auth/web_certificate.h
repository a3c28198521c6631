// The certificate that a session's web server shows to browsers. A browser knows no session, so a
// person installs its issuer, or goes on past the browser's warning. The issuer's private key is
// thrown away once it has signed: a phone that installs it trusts this one certificate and nothing
// that could be made later.
//
//   keys/web.pem   0600; certificate, its private key (ECDSA P-256), issuer's certificate
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/bytes.h"
#include "core/result.h"

namespace skein {

struct WebCertificate {
  std::string chain_pem;    // certificate, then issuer
  std::string key_pem;      // the certificate's private key
  Bytes issuer_der;         // for a phone to install
  std::string fingerprint;  // SHA-256 of the issuer's certificate, as browsers show it: "AB:CD:..."
};

// Browsers take no certificate that is valid for longer (Apple's rule).
inline constexpr int kWebCertificateDays = 397;

// For these names, IP addresses or host names; at least one. A new certificate is made if the file
// is missing, does not hold for one of them, or ends within 30 days of `now_s` (since 1970 UTC):
// phones must then install the new issuer. `dir` is the folder keys/. An error says which file and
// what to do.
Result<WebCertificate> OpenWebCertificate(const std::string& dir,
                                          const std::vector<std::string>& names, int64_t now_s);

// WebCertificate::fingerprint of what OpenWebCertificate made last. DataLoss: keys/web.pem is
// damaged. NotFound: there is none.
Result<std::string> ReadWebFingerprint(const std::string& dir);

// DataLoss: keys/web.pem is damaged. NotFound: there is none.
Status CheckWebCertificate(const std::string& dir);

}  // namespace skein
