#include "transport/invitation.h"

#include <regex>
#include <stdexcept>

#include "auth/relay_certificate.h"
#include "auth/session_keys.h"
#include "core/file.h"

namespace skein {
namespace {

// A link has some 250. The stack that matching it takes grows with the text.
constexpr size_t kMaxLinkBytes = 2000;
constexpr size_t kMaxFileBytes = 64 << 10;

Status NoInvitation(const std::string& why) {
  return InvalidArgument("the invitation " + why + "; `skein invite` prints one, give it whole");
}

Result<std::string> TextOf(const std::string& link) {
  if (link.empty() || link[0] != '@') return link;
  const Result<Bytes> bytes = ReadFile(link.substr(1), kMaxFileBytes);
  if (!bytes.ok()) return bytes.status();
  const std::string text(bytes->begin(), bytes->end());
  return text.substr(0, text.find_first_of(" \t\r\n"));
}

Result<LcmUrl> UrlOf(const std::string& address, const std::string& provider,
                     const std::string& ttl) {
  try {
    return ParseLcmUrl(provider + "://" + address + (ttl.empty() ? "" : "?ttl=" + ttl));
  } catch (const std::invalid_argument&) {
    return NoInvitation("has no usable address");
  }
}

}  // namespace

bool IsInvitedName(const std::string& name) {
  static const std::regex kForm("[A-Za-z0-9_-]{1,24}");
  return std::regex_match(name, kForm);
}

std::string ToLink(const Invitation& invitation) {
  ByteWriter code;
  code.PutRaw(invitation.trust.root.data(), invitation.trust.root.size());
  const Bytes credential = EncodeCredential(invitation.credential);
  code.PutRaw(credential.data(), credential.size());
  const Certificate& certificate = invitation.credential.certificate;
  const LcmUrl& url = invitation.url;
  const Bytes pin = FromBase64Url(url.pin).value_or(Bytes());
  code.PutRaw(pin.data(), pin.size());
  const std::string provider =
      url.provider == "udpm" ? "udpm-" + std::to_string(url.ttl) : url.provider;
  return "skein://" + url.host + ":" + std::to_string(url.port) + "/" + provider + "/" +
         invitation.trust.session_id + "/" + RoleName(certificate.role) + "/" + certificate.name +
         "/" + ToBase64Url(code.bytes());
}

Result<Invitation> ReadInvitation(const std::string& link) {
  // A host's name has at most 253 characters (RFC 1035), a port 5.
  static const std::regex kForm(
      "skein://([!-.0-~]{1,259})/(tcpqs?|udpm)(?:-([0-9]+))?/([0-9a-f]{16})/([a-z]+)/"
      "([A-Za-z0-9_-]+)/([A-Za-z0-9_-]+)");
  const Result<std::string> text = TextOf(link);
  if (!text.ok()) return text.status();
  if (text->size() > kMaxLinkBytes) return NoInvitation("is too long");
  std::smatch parts;
  if (!std::regex_match(*text, parts, kForm)) return NoInvitation("is not of the form skein://...");
  Result<LcmUrl> url = UrlOf(parts[1], parts[2], parts[3]);
  if (!url.ok()) return url.status();
  const std::optional<Bytes> code = FromBase64Url(parts[7]);
  SessionTrust trust{parts[4], {}};
  if (!code || code->size() < trust.root.size()) return NoInvitation("is damaged");
  ByteReader in(*code);
  in.GetRaw(trust.root.data(), trust.root.size());
  const size_t pin_bytes = url->provider == "tcpqs" ? kPinBytes : 0;
  if (in.remaining() < pin_bytes) return NoInvitation("is damaged");
  const uint8_t* pin = in.data() + in.remaining() - pin_bytes;
  url->pin = ToBase64Url(Bytes(pin, pin + pin_bytes));
  const Result<Credential> credential = DecodeCredential(Bytes(in.data(), pin));
  if (!credential.ok() || credential->certificate.name != parts[6] ||
      !IsGenuine(credential->certificate, trust)) {
    return NoInvitation("is damaged");
  }
  return Invitation{*url, trust, *credential};
}

}  // namespace skein
