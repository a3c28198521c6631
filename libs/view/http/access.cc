#include "http/access.h"

#include <charconv>

#include "core/utf8.h"
#include "transport/loopback.h"

namespace skein {
namespace {

// "127.0.0.1:8470" -> "127.0.0.1", "[::1]:8470" -> "::1".
std::string WithoutPort(const std::string& host) {
  if (!host.empty() && host.front() == '[') {
    const size_t end = host.find(']');
    return end == std::string::npos ? "" : host.substr(1, end - 1);
  }
  return host.substr(0, host.find(':'));
}

bool NamesServer(const AccessRequest& request) {
  const std::string name = LowerCase(WithoutPort(*request.host));
  if (name == request.local_address) return true;
  if (!request.public_host.empty() && name == LowerCase(request.public_host)) return true;
  return IsLoopbackAddress(request.local_address) && name == "localhost";
}

enum class Right {
  kPage,      // the page's files; says nothing of the session
  kEnter,     // shows a pass
  kKnow,      // which session it is
  kRead,      // everything
  kOnePhoto,  // a photo
  kSend,      // photos, and what became of the sender's own
  kMetrics,   // figures of the session and its processes
  kInvite,
  kFinish,
};

bool BeginsWith(const std::string& text, const std::string& beginning) {
  return text.compare(0, beginning.size(), beginning) == 0;
}

constexpr char kPhotoPath[] = "/api/photos/";
constexpr char kUploadPath[] = "/api/uploads/";

// The photo of /api/photos/ID and /api/photos/ID/thumbnail.
std::optional<int64_t> PhotoOf(const std::string& path) {
  if (!BeginsWith(path, kPhotoPath)) return std::nullopt;
  const char* begin = path.data() + sizeof(kPhotoPath) - 1;
  const char* end = path.data() + path.size();
  int64_t id = 0;
  const auto read = std::from_chars(begin, end, id);
  const std::string rest(read.ptr, end);
  if (read.ec != std::errc() || (!rest.empty() && rest != "/thumbnail")) return std::nullopt;
  return id;
}

// None: nothing answers that method there.
std::optional<Right> RightFor(const std::string& method, const std::string& path) {
  const bool reads = method == "GET" || method == "HEAD";
  if (BeginsWith(path, kUploadPath)) {
    const bool sends = method == "PATCH" || method == "POST" || method == "HEAD";
    return sends ? std::optional<Right>(Right::kSend) : std::nullopt;
  }
  if (method == "POST") {
    if (path == "/api/enter") return Right::kEnter;
    if (path == "/api/invitations") return Right::kInvite;
    if (path == "/api/finish") return Right::kFinish;
  }
  if (!reads) return std::nullopt;
  if (path == "/api/session") return Right::kKnow;
  if (path == "/metrics") return Right::kMetrics;
  if (PhotoOf(path)) return Right::kOnePhoto;
  if (BeginsWith(path, "/api/") || BeginsWith(path, "/download/") || path == "/api" ||
      path == "/ws") {
    return Right::kRead;
  }
  return Right::kPage;
}

AccessDecision Denied(const char* what) {
  return {403, std::string("this invitation is not for that: ") + what};
}

// By the server's own port, without a pass.
bool LocalMay(Right right, bool is_on_host) {
  const bool reads = right == Right::kKnow || right == Right::kRead || right == Right::kOnePhoto ||
                     right == Right::kMetrics;
  return reads || (is_on_host && right == Right::kInvite);
}

AccessDecision DecideRight(Right right, const AccessRequest& request) {
  const Visitor& visitor = request.visitor;
  const bool is_on_host = IsLoopbackAddress(request.local_address);
  if (right == Right::kPage) return {};
  if (visitor.is_local) {
    if (LocalMay(right, is_on_host)) return {};
    if (!is_on_host) return {403, "this port takes no pass: open the view on its own host"};
  }
  if (right == Right::kEnter) return {};
  if (!visitor.role && visitor.is_local) {
    return {403,
            "open the operator's link that `skein launch` prints, or take the skein command: "
            "photos and commands come with a pass"};
  }
  if (!visitor.role && !visitor.refusal.empty()) return {401, visitor.refusal};
  if (!visitor.role) {
    return {401,
            "open the link of your invitation; who runs the session makes one with `skein "
            "invite`"};
  }
  switch (*visitor.role) {
    case Role::kOperator:
      return {};
    case Role::kViewer:
      if (right == Right::kSend) return Denied("it is for looking; ask for one for an agent");
      if (right == Right::kInvite || right == Right::kFinish) return Denied("it is for looking");
      if (right == Right::kMetrics) return Denied("figures are for an operator's");
      return {};
    case Role::kAgent:
      if (right == Right::kKnow || right == Right::kSend) return {};
      if (right == Right::kOnePhoto && request.agent_of &&
          request.agent_of(*PhotoOf(request.path)) == visitor.name) {
        return {};
      }
      return Denied("it is for sending photos and seeing one's own");
    default:
      return Denied("its role has no page");
  }
}

}  // namespace

AccessDecision DecideAccess(const AccessRequest& request) {
  const std::optional<Right> right = RightFor(request.method, request.path);
  if (!right) return {405, request.method + " is not answered there; GET and HEAD are"};
  const std::string scheme = request.is_encrypted ? "https://" : "http://";
  if (!request.host || !NamesServer(request)) {
    const std::string& name =
        request.public_host.empty() ? request.local_address : request.public_host;
    return {403, "open the view by the server's address, " + scheme + name +
                     "/ and its port; other host names are refused"};
  }
  const std::string own_origin = scheme + LowerCase(*request.host);
  const bool reads = request.method == "GET" || request.method == "HEAD";
  if ((request.is_websocket || !reads) && request.origin &&
      LowerCase(*request.origin) != own_origin) {
    return {403, "this is for pages of " + own_origin + " alone"};
  }
  return DecideRight(*right, request);
}

}  // namespace skein
