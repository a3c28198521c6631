#include "web/access.h"

#include <algorithm>

namespace skein {
namespace {

std::string LowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return text;
}

// "127.0.0.1:8470" -> "127.0.0.1", "[::1]:8470" -> "::1".
std::string WithoutPort(const std::string& host) {
  if (!host.empty() && host.front() == '[') {
    const size_t end = host.find(']');
    return end == std::string::npos ? "" : host.substr(1, end - 1);
  }
  return host.substr(0, host.find(':'));
}

bool IsLoopback(const std::string& address) {
  return address.compare(0, 4, "127.") == 0 || address == "::1";
}

bool NamesServer(const std::string& host, const std::string& local_address) {
  const std::string name = LowerCase(WithoutPort(host));
  if (name == local_address) return true;
  return IsLoopback(local_address) && name == "localhost";
}

}  // namespace

AccessDecision DecideAccess(const AccessRequest& request) {
  if (request.method != "GET" && request.method != "HEAD") {
    return {405, "only GET and HEAD are answered"};
  }
  if (!request.host || !NamesServer(*request.host, request.local_address)) {
    return {403, "open the view by the server's address, http://" + request.local_address +
                     "/ and its port; other host names are refused"};
  }
  const std::string own_origin = "http://" + LowerCase(*request.host);
  if (request.is_websocket && request.origin && LowerCase(*request.origin) != own_origin) {
    return {403, "the WebSocket is for pages of " + own_origin};
  }
  return {};
}

}  // namespace skein
