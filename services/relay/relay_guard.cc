#include "relay/relay_guard.h"

#include <utility>

#include "transport/roles.h"

namespace skein {
namespace {

constexpr char kOurs[] = "SKEIN_";

RelayGuard::Verdict Refused(const char* why) { return {why, false}; }

}  // namespace

RelayGuard::RelayGuard(MessageSeal seal, bool takes_unsigned)
    : seal_(std::move(seal)), takes_unsigned_(takes_unsigned) {}

RelayGuard::Verdict RelayGuard::Check(const std::string& channel, const Bytes& message) {
  if (takes_unsigned_ && channel.rfind(kOurs, 0) != 0) return {};
  const OpenedMessage opened = seal_.Open(channel, message);
  switch (opened.kind) {
    case OpenedMessage::Kind::kRefused:
      return Refused(opened.reason);
    case OpenedMessage::Kind::kOtherSession:
      return takes_unsigned_ ? Verdict{}
                             : Refused("it is of another session, which needs a relay of its own");
    case OpenedMessage::Kind::kUnsigned:
      if (!takes_unsigned_) return Refused("it is not signed");
      return MayPublish(std::nullopt, channel) ? Verdict{} : Refused("nobody may say so unsigned");
    case OpenedMessage::Kind::kSigned:
      break;
  }
  return {MayPublish(opened.speaker, channel) ? nullptr : "its role may not say so", true};
}

}  // namespace skein
