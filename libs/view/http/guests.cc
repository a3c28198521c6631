#include "http/guests.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/utf8.h"

namespace skein {
namespace {

using nlohmann::json;

// A browser that was lent or lost forgets. Who comes back later opens the link again.
constexpr int64_t kLongestCookieS = 30 * 86'400;

// "a=1; b=2", "b" -> "2".
std::string CookieOf(const std::string& cookies, const std::string& name) {
  size_t begin = 0;
  while (begin < cookies.size()) {
    const size_t end = std::min(cookies.find(';', begin), cookies.size());
    const size_t first = cookies.find_first_not_of(' ', begin);
    if (first != std::string::npos && cookies.compare(first, name.size() + 1, name + "=") == 0) {
      return cookies.substr(first + name.size() + 1, end - first - name.size() - 1);
    }
    begin = end + 1;
  }
  return "";
}

// "Bearer x" -> "x"; "" for another scheme.
std::string BearerOf(const std::string& authorization) {
  constexpr size_t kSchemeBytes = 7;
  const bool is_bearer = LowerCase(authorization.substr(0, kSchemeBytes)) == "bearer ";
  return is_bearer ? authorization.substr(kSchemeBytes) : "";
}

Status Revoked() { return InvalidArgument("this invitation was revoked"); }

}  // namespace

Result<WebPass> Guests::Open(const std::string& text, int64_t now_s) const {
  Result<WebPass> pass = OpenWebPass(text, trust_, now_s);
  if (pass.ok() && IsRevokedName(pass->name)) return Revoked();
  return pass;
}

bool Guests::IsRevokedName(const std::string& name) const {
  if (!is_revoked_) return false;
  const std::lock_guard lock(mutex_);
  return is_revoked_(name);
}

Visitor Guests::Find(const std::string& cookies, const std::string& authorization,
                     int64_t now_s) const {
  Visitor visitor;
  std::string text = CookieOf(cookies, CookieName());
  if (text.empty()) text = BearerOf(authorization);
  if (text.empty()) return visitor;
  const Result<WebPass> pass = Open(text, now_s);
  if (!pass.ok()) {
    visitor.refusal = pass.error();
    return visitor;
  }
  visitor.role = pass->role;
  visitor.name = pass->name;
  visitor.expires_s = pass->expires_s;
  return visitor;
}

Status Guests::Check(const Visitor& visitor, int64_t now_s) const {
  if (IsRevokedName(visitor.name)) return Revoked();
  return HasExpired(visitor.expires_s, now_s) ? Expired() : Status::Ok();
}

HttpResponse Guests::Enter(const std::string& body, bool is_encrypted, int64_t now_s) const {
  const json said = json::parse(body, nullptr, false);
  if (!said.is_object() || !said.contains("pass") || !said["pass"].is_string()) {
    return HttpError(400, "give {\"pass\": \"...\"}");
  }
  const std::string text = said["pass"];
  const Result<WebPass> pass = Open(text, now_s);
  if (!pass.ok()) return HttpError(401, pass.error());
  const int64_t left_s = pass->expires_s == 0 ? kLongestCookieS : pass->expires_s - now_s;
  HttpResponse response = JsonResponse(json({{"role", RoleName(pass->role)}, {"name", pass->name}})
                                           .dump(-1, ' ', false, json::error_handler_t::replace));
  response.fields.emplace_back("Set-Cookie", CookieName() + "=" + text +
                                                 "; Path=/; HttpOnly; SameSite=Strict; Max-Age=" +
                                                 std::to_string(std::min(left_s, kLongestCookieS)) +
                                                 (is_encrypted ? "; Secure" : ""));
  return response;
}

}  // namespace skein
