// A message with its trailer, on a channel, as each receiver opens it; and a credential's bytes.
#include "auth/message_seal.h"
#include "auth/session_keys.h"
#include "fuzz/fuzz.h"
#include "fuzz/test_keys.h"

namespace skein::fuzz {

SKEIN_FUZZ_TARGET(seal) {
  static const TestKeys keys;
  static const MessageSeal unused(keys.trust, keys.credential, {}, [] { return int64_t{0}; });
  MessageSeal seal = unused;
  const Bytes message = ToBytes(data, size);
  const OpenedMessage opened = seal.Open("SKEIN_IMAGE_OFFER", message);
  Expect(opened.size <= size, "a message is no longer than what came");
  Expect(SizeWithoutTrailer(message) <= size, "a trailer takes away, it adds nothing");
  if (opened.kind == OpenedMessage::Kind::kSigned) {
    Expect(opened.speaker.name == keys.credential.certificate.name, "the root signed one name");
    Expect(seal.Open("SKEIN_IMAGE_OFFER", message).kind == OpenedMessage::Kind::kRefused,
           "a message is taken once");
  }
  const Result<Credential> credential = DecodeCredential(message);
  if (credential.ok()) {
    Expect(EncodeCredential(*credential) == message, "a credential has one form");
  }
}

}  // namespace skein::fuzz
