// Decides what a relay with its session's keys forwards: messages that the receivers would take
// (docs/security.md). The receivers check again. A relay is not to be trusted, and a session may
// have another.
#pragma once

#include <string>

#include "auth/message_seal.h"

namespace skein {

class RelayGuard {
 public:
  // takes_unsigned: a message without a signature is forwarded where anybody may say so. Channels
  // that are not Skein's, and other sessions, are then none of its business.
  RelayGuard(MessageSeal seal, bool takes_unsigned);

  bool takes_unsigned() const { return takes_unsigned_; }
  // False for channels that are none of its business.
  bool IsToCheck(const std::string& channel) const;

  struct Verdict {
    const char* why_refused = nullptr;  // null: it is to be forwarded
    bool is_signed = false;             // by a key of the session
  };
  // A signed message costs the verification of its signature: 50 to 140 us (docs/measurements.md).
  Verdict Check(const std::string& channel, const Bytes& message);
  // Null if the hello (transport/tcpq_wire.h) is of one who belongs to the session, signed for the
  // connection of this binding; else why not.
  const char* WhyNoMember(const Bytes& hello, const Bytes& binding);

 private:
  MessageSeal seal_;
  const bool takes_unsigned_;
};

}  // namespace skein
