#include "auth/certificate.h"

#include <iterator>
#include <stdexcept>

namespace skein {
namespace {

constexpr const char* kRoleNames[] = {"ingest", "worker", "agent", "operator", "viewer", "web"};
constexpr char kCertificateDomain[] = "skein-certificate-1";

bool IsRole(uint8_t number) { return number >= 1 && number <= std::size(kRoleNames); }

// The certificate but for its signature.
void AppendClaims(const Certificate& certificate, ByteWriter* out) {
  out->Put(certificate.role);
  out->Put(static_cast<uint8_t>(certificate.name.size()));
  out->PutRaw(certificate.name.data(), certificate.name.size());
  out->Put(certificate.expires_s);
  out->PutRaw(certificate.public_key.data(), certificate.public_key.size());
}

// What the root signs: domain, session's id, claims. The zeros keep the parts apart.
Bytes SignedBytes(const Certificate& certificate, const std::string& session_id) {
  ByteWriter out;
  out.PutRaw(kCertificateDomain, sizeof(kCertificateDomain));
  out.PutRaw(session_id.c_str(), session_id.size() + 1);
  AppendClaims(certificate, &out);
  return out.Take();
}

}  // namespace

const char* RoleName(Role role) { return kRoleNames[static_cast<size_t>(role) - 1]; }

std::optional<Role> RoleFromName(const std::string& name) {
  for (size_t i = 0; i < std::size(kRoleNames); ++i) {
    if (name == kRoleNames[i]) return static_cast<Role>(i + 1);
  }
  return std::nullopt;
}

void AppendCertificate(const Certificate& certificate, ByteWriter* out) {
  AppendClaims(certificate, out);
  out->PutRaw(certificate.by_root.data(), certificate.by_root.size());
}

bool ReadCertificate(ByteReader* in, Certificate* certificate) {
  uint8_t role = 0, name_bytes = 0;
  if (!in->Get(&role) || !in->Get(&name_bytes) || !IsRole(role)) return false;
  if (name_bytes == 0 || name_bytes > kMaxCertifiedName || in->remaining() < name_bytes) {
    return false;
  }
  certificate->role = static_cast<Role>(role);
  certificate->name.assign(reinterpret_cast<const char*>(in->data()), name_bytes);
  in->Skip(name_bytes);
  return in->Get(&certificate->expires_s) &&
         in->GetRaw(certificate->public_key.data(), certificate->public_key.size()) &&
         in->GetRaw(certificate->by_root.data(), certificate->by_root.size());
}

Credential IssueCredential(const SigningKey& root, const std::string& session_id, Role role,
                           const std::string& name, int64_t expires_s) {
  if (name.empty() || name.size() > kMaxCertifiedName) {
    throw std::invalid_argument("the name of a credential has 1 to 64 bytes");
  }
  Credential credential{SigningKey::Generate(), {}};
  Certificate& certificate = credential.certificate;
  certificate.role = role;
  certificate.name = name;
  certificate.expires_s = expires_s;
  certificate.public_key = credential.key.public_key();
  certificate.by_root = root.Sign(SignedBytes(certificate, session_id));
  return credential;
}

bool IsGenuine(const Certificate& certificate, const SessionTrust& trust) {
  return IsSignedBy(trust.root, SignedBytes(certificate, trust.session_id), certificate.by_root);
}

}  // namespace skein
