// Visitors with a pass (auth/web_pass.h): in a cookie that scripts cannot read, or as the bearer
// token (RFC 6750) of a program.
#pragma once

#include <functional>
#include <mutex>
#include <string>

#include "auth/certificate.h"
#include "auth/web_pass.h"
#include "core/result.h"
#include "http/http.h"

namespace skein {

using IsRevoked = std::function<bool(const std::string& name)>;

// Keeps nothing: the cookie is the pass. Any thread.
class Guests {
 public:
  // `is_revoked`: whose pass counts no more, by its name; called by one thread at a time.
  Guests(SessionTrust trust, IsRevoked is_revoked)
      : trust_(std::move(trust)), is_revoked_(std::move(is_revoked)) {}

  // By the Cookie header, else by the Authorization header; "" where there is none.
  Visitor Find(const std::string& cookies, const std::string& authorization, int64_t now_s) const;

  // Whether the pass of a visitor that Find returned still holds; the error is a line for who has
  // it.
  Status Check(const Visitor& visitor, int64_t now_s) const;

  // Answers {"pass": "..."}: the cookie, with {role, name}; or 401 with what is wrong.
  HttpResponse Enter(const std::string& body, bool is_encrypted, int64_t now_s) const;

 private:
  std::string CookieName() const { return "skein_" + trust_.session_id; }

  Result<WebPass> Open(const std::string& text, int64_t now_s) const;
  bool IsRevokedName(const std::string& name) const;

  const SessionTrust trust_;
  mutable std::mutex mutex_;
  const IsRevoked is_revoked_;  // under mutex_
};

}  // namespace skein
