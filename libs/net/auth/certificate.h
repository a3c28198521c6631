// Owner of a key: role and name, signed by the session's root key.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "auth/signing_key.h"
#include "core/bytes.h"
#include "core/result.h"

namespace skein {

// The numbers stand in messages.
enum class Role : uint8_t {
  kIngest = 1,  // speaks the ledger
  kWorker,      // works and submits in its own name: features, retrieval, matching, mapper, merger
  kAgent,       // offers photos, and reads
  kOperator,    // commands; also what an agent may
  kViewer,      // reads
  kWeb,         // lets browsers in: a viewer that offers the photos of its agents, and passes on
                // its operators' commands; of the session's host alone
};

const char* RoleName(Role role);
std::optional<Role> RoleFromName(const std::string& name);

// Trust of a session: a certificate holds in it if the root signed it for this session id.
struct SessionTrust {
  std::string session_id;
  PublicKey root{};
};

struct Certificate {
  Role role = Role::kViewer;
  std::string name;       // 1 to kMaxCertifiedName bytes
  int64_t expires_s = 0;  // since 1970 UTC; 0: never
  PublicKey public_key{};
  Signature by_root{};
};

inline constexpr size_t kMaxCertifiedName = 64;

// Role, size of the name and name, expiry, public key, root's signature; little endian.
void AppendCertificate(const Certificate& certificate, ByteWriter* out);
bool ReadCertificate(ByteReader* in, Certificate* certificate);

// A key with its certificate.
struct Credential {
  SigningKey key;
  Certificate certificate;
};

// Throws std::invalid_argument for a name without bytes or with too many.
Credential IssueCredential(const SigningKey& root, const std::string& session_id, Role role,
                           const std::string& name, int64_t expires_s);

// Whether the session's root signed it. Says nothing of its expiry.
bool IsGenuine(const Certificate& certificate, const SessionTrust& trust);
inline bool IsExpired(const Certificate& certificate, int64_t now_s) {
  return certificate.expires_s != 0 && now_s >= certificate.expires_s;
}

}  // namespace skein
