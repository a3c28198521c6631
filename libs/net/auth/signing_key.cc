#include "auth/signing_key.h"

#include <sodium.h>

#include <stdexcept>

namespace skein {
namespace {

constexpr int kUrlVariant = sodium_base64_VARIANT_URLSAFE_NO_PADDING;

// Before anything else of libsodium; any thread, any number of times.
void InitSodium() {
  if (sodium_init() < 0) throw std::runtime_error("libsodium cannot be set up");
}

}  // namespace

SigningKey SigningKey::Generate() {
  InitSodium();
  Seed seed;
  randombytes_buf(seed.data(), seed.size());
  return SigningKey(seed);
}

SigningKey::SigningKey(const Seed& seed) : seed_(seed) {
  InitSodium();
  crypto_sign_seed_keypair(public_key_.data(), secret_.data(), seed_.data());
}

Signature SigningKey::Sign(const Bytes& bytes) const {
  Signature signature;
  crypto_sign_detached(signature.data(), nullptr, bytes.data(), bytes.size(), secret_.data());
  return signature;
}

bool IsSignedBy(const PublicKey& key, const Bytes& bytes, const Signature& signature) {
  InitSodium();
  return crypto_sign_verify_detached(signature.data(), bytes.data(), bytes.size(), key.data()) == 0;
}

std::string ToBase64Url(const Bytes& bytes) {
  std::string text(sodium_base64_encoded_len(bytes.size(), kUrlVariant), '\0');
  sodium_bin2base64(text.data(), text.size(), bytes.data(), bytes.size(), kUrlVariant);
  text.pop_back();  // the zero at the end
  return text;
}

std::optional<Bytes> FromBase64Url(const std::string& text) {
  if (text.empty()) return Bytes();  // libsodium wants memory
  Bytes bytes(text.size());
  size_t size = 0;
  const char* end = nullptr;
  if (sodium_base642bin(bytes.data(), bytes.size(), text.data(), text.size(), nullptr, &size, &end,
                        kUrlVariant) != 0 ||
      end != text.data() + text.size()) {
    return std::nullopt;
  }
  bytes.resize(size);
  return bytes;
}

}  // namespace skein
