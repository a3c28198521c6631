#include "transport/lcm_url.h"

#include <charconv>
#include <sstream>
#include <stdexcept>

#include "auth/relay_certificate.h"
#include "transport/loopback.h"

namespace skein {
namespace {

constexpr char kDefaultUrl[] = "udpm://239.255.76.67:7667?ttl=0";

[[noreturn]] void Refuse(const std::string& url, const std::string& why) {
  throw std::invalid_argument("LCM URL \"" + url + "\": " + why +
                              "; write udpm://239.255.76.67:7667?ttl=0, tcpq://HOST:7700 or "
                              "tcpqs://HOST:7700");
}

int ParseNumber(const std::string& url, const std::string& text, int low, int high) {
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || number < low || number > high) {
    Refuse(url, "\"" + text + "\" is not a number from " + std::to_string(low) + " to " +
                    std::to_string(high));
  }
  return number;
}

void ParseAddress(const std::string& url, const std::string& address, LcmUrl* parsed) {
  const size_t colon = address.find(':');
  const std::string host = address.substr(0, colon);
  if (!host.empty()) parsed->host = host;
  if (colon == std::string::npos) return;
  parsed->port = ParseNumber(url, address.substr(colon + 1), 1, 65534);
}

void ParseOptions(const std::string& url, const std::string& options, LcmUrl* parsed) {
  std::istringstream stream(options);
  for (std::string option; std::getline(stream, option, '&');) {
    const size_t equals = option.find('=');
    const std::string key = option.substr(0, equals);
    const std::string value = equals == std::string::npos ? "" : option.substr(equals + 1);
    if (key == "ttl") {
      parsed->ttl = ParseNumber(url, value, 0, 255);
    } else if (key == "recv_buf_size") {
      parsed->recv_buf_size = ParseNumber(url, value, 1, 1 << 30);
    } else if (key == "pin" && parsed->provider == "tcpqs") {
      if (!IsCertificatePin(value)) Refuse(url, "\"" + value + "\" is no certificate's pin");
      parsed->pin = value;
    } else if (!option.empty()) {
      Refuse(url, "\"" + key + "\" is no option: there are ttl, recv_buf_size, and pin of tcpqs");
    }
  }
}

}  // namespace

std::string LcmUrl::ToString() const {
  if (provider == "memq") return "memq://";
  std::string text = provider + "://" + host + ":" + std::to_string(port);
  if (!pin.empty()) text += "?pin=" + pin;
  if (provider != "udpm") return text;
  return text + "?ttl=" + std::to_string(ttl) + "&recv_buf_size=" + std::to_string(recv_buf_size);
}

LcmUrl LcmUrl::Bulk() const {
  LcmUrl bulk = *this;
  if (provider != "memq") ++bulk.port;
  return bulk;
}

bool LcmUrl::leaves_host() const {
  if (!goes_over_relay()) return leaves_host_by_datagram();
  return host != "localhost" && !IsLoopbackAddress(host);
}

LcmUrl ParseLcmUrl(const std::string& text) {
  const std::string url = text.empty() ? kDefaultUrl : text;
  const size_t colon = url.find("://");
  if (colon == std::string::npos) Refuse(url, "no \"://\" in it");
  LcmUrl parsed;
  parsed.provider = url.substr(0, colon);
  if (parsed.provider == "memq") return parsed;
  const bool tcpq = parsed.goes_over_relay();
  if (parsed.provider != "udpm" && !tcpq) Refuse(url, "unknown transport");
  parsed.host = tcpq ? "127.0.0.1" : "239.255.76.67";
  parsed.port = tcpq ? 7700 : 7667;
  const std::string rest = url.substr(colon + 3);
  const size_t question = rest.find('?');
  ParseAddress(url, rest.substr(0, question), &parsed);
  if (question != std::string::npos) ParseOptions(url, rest.substr(question + 1), &parsed);
  return parsed;
}

}  // namespace skein
