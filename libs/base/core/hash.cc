#include "core/hash.h"

#include <openssl/evp.h>

#include <algorithm>
#include <stdexcept>

namespace skein {
namespace {

void Check(int result) {
  if (result != 1) throw std::runtime_error("OpenSSL: SHA-256 failed");
}

}  // namespace

std::string ToHex(const void* data, size_t size) {
  static constexpr char kDigits[] = "0123456789abcdef";
  const auto* const bytes = static_cast<const unsigned char*>(data);
  std::string text;
  text.reserve(2 * size);
  for (size_t i = 0; i < size; ++i) {
    text += kDigits[bytes[i] >> 4];
    text += kDigits[bytes[i] & 15];
  }
  return text;
}

struct Hasher::Context {
  Context() : evp(EVP_MD_CTX_new()) { Check(EVP_DigestInit_ex(evp, EVP_sha256(), nullptr)); }
  ~Context() { EVP_MD_CTX_free(evp); }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  EVP_MD_CTX* evp;
};

Hasher::Hasher() : context_(std::make_unique<Context>()) {}
Hasher::~Hasher() = default;
Hasher::Hasher(Hasher&&) noexcept = default;
Hasher& Hasher::operator=(Hasher&&) noexcept = default;

void Hasher::Update(const void* data, size_t size) {
  Check(EVP_DigestUpdate(context_->evp, data, size));
}

std::string Hasher::Finish() {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int size = 0;
  Check(EVP_DigestFinal_ex(context_->evp, digest, &size));
  Check(EVP_DigestInit_ex(context_->evp, EVP_sha256(), nullptr));
  return ToHex(digest, size);
}

std::string HashBytes(const void* data, size_t size) {
  Hasher hasher;
  hasher.Update(data, size);
  return hasher.Finish();
}

bool IsBlobId(std::string_view text) {
  return text.size() == kHashSize && std::all_of(text.begin(), text.end(), [](char c) {
           return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
         });
}

}  // namespace skein
