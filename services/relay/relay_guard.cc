#include "relay/relay_guard.h"

#include <algorithm>
#include <utility>

#include "transport/roles.h"
#include "transport/tcpq_wire.h"

namespace skein {
namespace {

constexpr char kOurs[] = "SKEIN_";
constexpr char kOtherSession[] = "it is of another session, which needs a relay of its own";
constexpr char kNotSigned[] = "it is not signed";

RelayGuard::Verdict Refused(const char* why) { return {why, false}; }

}  // namespace

RelayGuard::RelayGuard(MessageSeal seal, bool takes_unsigned)
    : seal_(std::move(seal)), takes_unsigned_(takes_unsigned) {}

bool RelayGuard::IsToCheck(const std::string& channel) const {
  return !takes_unsigned_ || channel.rfind(kOurs, 0) == 0;
}

RelayGuard::Verdict RelayGuard::Check(const std::string& channel, const Bytes& message) {
  if (!IsToCheck(channel)) return {};
  const OpenedMessage opened = seal_.Open(channel, message);
  switch (opened.kind) {
    case OpenedMessage::Kind::kRefused:
      return Refused(opened.reason);
    case OpenedMessage::Kind::kOtherSession:
      return takes_unsigned_ ? Verdict{} : Refused(kOtherSession);
    case OpenedMessage::Kind::kUnsigned:
      if (!takes_unsigned_) return Refused(kNotSigned);
      return MayPublish(std::nullopt, channel) ? Verdict{} : Refused("nobody may say so unsigned");
    case OpenedMessage::Kind::kSigned:
      break;
  }
  return {MayPublish(opened.speaker, channel) ? nullptr : "its role may not say so", true};
}

const char* RelayGuard::WhyNoMember(const Bytes& hello, const Bytes& binding) {
  const auto end = hello.begin() + static_cast<std::ptrdiff_t>(SizeWithoutTrailer(hello));
  if (!std::equal(hello.begin(), end, binding.begin(), binding.end())) {
    return "it was signed for another connection, or by an older version";
  }
  const OpenedMessage opened = seal_.Open(tcpq::kHelloChannel, hello);
  switch (opened.kind) {
    case OpenedMessage::Kind::kRefused:
      return opened.reason;
    case OpenedMessage::Kind::kOtherSession:
      return kOtherSession;
    case OpenedMessage::Kind::kUnsigned:
      return kNotSigned;
    case OpenedMessage::Kind::kSigned:
      break;
  }
  return nullptr;
}

}  // namespace skein
