// Who comes by a public port: a pass (auth/web_pass.h) in a cookie that scripts cannot read.
#pragma once

#include <string>

#include "auth/certificate.h"
#include "core/result.h"
#include "web/http.h"

namespace skein {

// Keeps nothing: the cookie is the pass. Any thread.
class Guests {
 public:
  explicit Guests(SessionTrust trust) : trust_(std::move(trust)) {}

  // By the Cookie header, "" if there is none.
  Visitor Find(const std::string& cookies, int64_t now_s) const;

  // Answers {"pass": "..."}: the cookie, with {role, name}; or 401 with what is wrong.
  HttpResponse Enter(const std::string& body, bool is_encrypted, int64_t now_s) const;

 private:
  std::string CookieName() const { return "skein_" + trust_.session_id; }

  const SessionTrust trust_;
};

}  // namespace skein
