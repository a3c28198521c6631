#include "auth/web_pass.h"

#include <stdexcept>

#include "auth/revocations.h"
#include "auth/session_keys.h"

namespace skein {
namespace {

constexpr char kPassDomain[] = "skein-web-pass-1";
constexpr size_t kMaxPassText = 256;

bool IsBrowserRole(Role role) {
  return role == Role::kAgent || role == Role::kOperator || role == Role::kViewer;
}

Bytes PassClaims(const WebPass& pass) {
  ByteWriter out;
  out.Put(pass.role);
  out.Put(static_cast<uint8_t>(pass.name.size()));
  out.PutRaw(pass.name.data(), pass.name.size());
  out.Put(pass.expires_s);
  return out.Take();
}

Bytes SignedPass(const WebPass& pass, const std::string& session_id) {
  ByteWriter out;
  out.PutRaw(kPassDomain, sizeof(kPassDomain));
  out.PutRaw(session_id.c_str(), session_id.size() + 1);
  const Bytes claims = PassClaims(pass);
  out.PutRaw(claims.data(), claims.size());
  return out.Take();
}

Status NoPass() {
  return InvalidArgument("this invitation is cut or damaged: open the whole link again");
}

bool ReadPass(const Bytes& bytes, WebPass* pass, Signature* signature) {
  ByteReader in(bytes);
  uint8_t role = 0, name_bytes = 0;
  if (!in.Get(&role) || !in.Get(&name_bytes) || in.remaining() < name_bytes) return false;
  pass->role = static_cast<Role>(role);
  pass->name.assign(reinterpret_cast<const char*>(in.data()), name_bytes);
  in.Skip(name_bytes);
  return in.Get(&pass->expires_s) && in.GetRaw(signature->data(), signature->size()) &&
         in.remaining() == 0 && IsBrowserRole(pass->role) && !pass->name.empty() &&
         pass->name.size() <= kMaxCertifiedName;
}

}  // namespace

Result<std::string> IssueWebPass(const std::string& keys_dir, const std::string& session_id,
                                 const WebPass& pass) {
  if (pass.name.empty() || pass.name.size() > kMaxCertifiedName || !IsBrowserRole(pass.role)) {
    throw std::invalid_argument("a pass is for an agent, operator or viewer with a name");
  }
  if (Status status = RecordInvitation(keys_dir, pass.name); !status) return status;
  const Result<Signature> signature = SignAsRoot(keys_dir, SignedPass(pass, session_id));
  if (!signature.ok()) return signature.status();
  Bytes bytes = PassClaims(pass);
  bytes.insert(bytes.end(), signature->begin(), signature->end());
  return ToBase64Url(bytes);
}

bool HasExpired(int64_t expires_s, int64_t now_s) { return expires_s != 0 && now_s >= expires_s; }

Status Expired() { return InvalidArgument("this invitation has expired: ask for another"); }

Result<WebPass> OpenWebPass(const std::string& text, const SessionTrust& trust, int64_t now_s) {
  const std::optional<Bytes> bytes =
      text.size() <= kMaxPassText ? FromBase64Url(text) : std::nullopt;
  WebPass pass;
  Signature signature;
  if (!bytes || !ReadPass(*bytes, &pass, &signature)) return NoPass();
  if (!IsSignedBy(trust.root, SignedPass(pass, trust.session_id), signature)) {
    return InvalidArgument("this invitation is for another session: ask for one of this session");
  }
  if (HasExpired(pass.expires_s, now_s)) return Expired();
  return pass;
}

}  // namespace skein
