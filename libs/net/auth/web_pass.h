// A pass for a browser: role, name and expiry, signed by the session's root. A browser that shows
// it has the role at the session's web server, and nowhere else: no message can be signed with it.
//
//   role 1 byte, size of the name 1 byte, name, expiry int64, signature 64 bytes; as base64url
//
// Signed is: "skein-web-pass-1", 0, the session's id, 0, then what stands before the signature.
#pragma once

#include <cstdint>
#include <string>

#include "auth/certificate.h"
#include "core/result.h"

namespace skein {

struct WebPass {
  Role role = Role::kViewer;  // kAgent, kOperator or kViewer
  std::string name;           // 1 to kMaxCertifiedName bytes
  int64_t expires_s = 0;      // since 1970 UTC; 0: never
};

// `keys_dir` is the folder keys/ of the session. Throws std::invalid_argument for a name without
// bytes or with too many, and for a role that no browser has. Fails for a name that may not be
// invited (auth/revocations.h).
Result<std::string> IssueWebPass(const std::string& keys_dir, const std::string& session_id,
                                 const WebPass& pass);

// An error says what to do: the text is no pass, of another session, or has expired.
Result<WebPass> OpenWebPass(const std::string& text, const SessionTrust& trust, int64_t now_s);

// Whether a pass or an invitation of this expiry, 0 for never, counts no more; the line for who has
// it.
bool HasExpired(int64_t expires_s, int64_t now_s);
Status Expired();

}  // namespace skein
