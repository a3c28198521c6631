// The trailer behind each message: who says it, and a signature. No messages, no bus.
//
//   message      as LCM encodes it; its decoders ignore what follows
//   session      8 bytes: the id's 16 hexadecimal digits as a number
//   certificate  auth/certificate.h
//   counter      uint64, rising with each message of a signer
//   signature    64 bytes, Ed25519
//   size         uint16, of the trailer, itself and the identifier included
//   identifier   "SKN1"
//
// Numbers are little endian. Signed is: "skein-message-1", 0, the session's id, 0, the channel, 0,
// then message, session, certificate and counter as they stand.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "auth/certificate.h"
#include "auth/replay_window.h"

namespace skein {

// Largest size of a trailer.
inline constexpr size_t kMaxTrailerBytes = 256;

// Bytes of the message without its trailer; all of them if it has none.
size_t SizeWithoutTrailer(const Bytes& message);

struct Speaker {
  Role role = Role::kViewer;
  std::string name;
};

struct OpenedMessage {
  enum class Kind {
    kSigned,        // by `speaker`
    kUnsigned,      // no trailer
    kOtherSession,  // a trailer of another session
    kRefused,       // for `reason`
  };
  Kind kind = Kind::kRefused;
  size_t size = 0;  // of the message without its trailer
  Speaker speaker;
  const char* reason = "";
};

// By public key: the highest counter known to be used.
using SignerCounters = std::map<PublicKey, uint64_t>;

class MessageSeal {
 public:
  using ClockUs = std::function<int64_t()>;  // microseconds since 1970 UTC

  // `used`: counters up to these are refused, and not used again. Throws std::invalid_argument for
  // a session's id that is not 16 hexadecimal digits.
  MessageSeal(SessionTrust trust, Credential credential, SignerCounters used, ClockUs now_us);

  // Refuses messages from now on whose certificate has a name for which `is_revoked` is true.
  void SetRevoked(std::function<bool(const std::string& name)> is_revoked);

  // The message with this signer's trailer.
  Bytes Seal(const std::string& channel, const Bytes& message);
  // A message that came before is refused, and so is one older than a ReplayWindow. The channels of
  // blob chunks have a window of their own: they come by another bus and overtake.
  OpenedMessage Open(const std::string& channel, const Bytes& message);

  const Certificate& certificate() const { return credential_.certificate; }
  SignerCounters Counters() const;

 private:
  struct Signer {
    Bytes certificate_bytes;  // found genuine
    int64_t expires_s = 0;
    ReplayWindow windows[2];
  };

  Signer* FindSigner(const Certificate& certificate, const Bytes& bytes, const char** reason);
  void ForgetExpired();

  const SessionTrust trust_;
  const Credential credential_;
  SignerCounters used_;
  const ClockUs now_us_;
  const uint64_t own_ns_;  // below 1000, by chance
  uint64_t counter_;
  std::function<bool(const std::string&)> is_revoked_;
  std::map<PublicKey, Signer> signers_;  // at most kMaxSigners
};

}  // namespace skein
