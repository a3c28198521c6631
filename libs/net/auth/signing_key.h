// Ed25519 (RFC 8032), by libsodium.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "core/bytes.h"

namespace skein {

using PublicKey = std::array<uint8_t, 32>;
using Signature = std::array<uint8_t, 64>;

class SigningKey {
 public:
  // The private half, as RFC 8032 has it: the public one follows from it.
  using Seed = std::array<uint8_t, 32>;

  // From the kernel's random source.
  static SigningKey Generate();
  explicit SigningKey(const Seed& seed);

  Signature Sign(const Bytes& bytes) const;
  const Seed& seed() const { return seed_; }
  const PublicKey& public_key() const { return public_key_; }

 private:
  Seed seed_;
  PublicKey public_key_;
  std::array<uint8_t, 64> secret_;  // libsodium's: seed, then public key
};

bool IsSignedBy(const PublicKey& key, const Bytes& bytes, const Signature& signature);

// Base64 for links and file names (RFC 4648, section 5), without padding.
std::string ToBase64Url(const Bytes& bytes);
std::optional<Bytes> FromBase64Url(const std::string& text);

}  // namespace skein
