// A message with its trailer, on a channel, as each receiver opens it; and a credential's bytes.
#include "auth/message_seal.h"
#include "auth/session_keys.h"
#include "fuzz/fuzz.h"
#include "fuzz/test_keys.h"

using namespace skein;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const fuzz::TestKeys keys;
  static const MessageSeal unused(keys.trust, keys.credential, {}, [] { return int64_t{0}; });
  MessageSeal seal = unused;
  const Bytes message = fuzz::ToBytes(data, size);
  const OpenedMessage opened = seal.Open("SKEIN_IMAGE_OFFER", message);
  fuzz::Expect(opened.size <= size, "a message is no longer than what came");
  fuzz::Expect(SizeWithoutTrailer(message) <= size, "a trailer takes away, it adds nothing");
  if (opened.kind == OpenedMessage::Kind::kSigned) {
    fuzz::Expect(opened.speaker.name == keys.credential.certificate.name,
                 "the root signed one name");
    fuzz::Expect(seal.Open("SKEIN_IMAGE_OFFER", message).kind == OpenedMessage::Kind::kRefused,
                 "a message is taken once");
  }
  const Result<Credential> credential = DecodeCredential(message);
  if (credential.ok()) {
    fuzz::Expect(EncodeCredential(*credential) == message, "a credential has one form");
  }
  return 0;
}
