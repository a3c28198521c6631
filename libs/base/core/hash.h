// SHA-256: the names of blobs; hexadecimal digits.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

namespace skein {

constexpr size_t kHashSize = 64;  // hexadecimal digits

// Two lower-case hexadecimal digits a byte.
std::string ToHex(const void* data, size_t size);

// SHA-256 as 64 lower-case hexadecimal digits.
std::string HashBytes(const void* data, size_t size);

// The same in pieces.
class Hasher {
 public:
  Hasher();
  ~Hasher();
  Hasher(Hasher&&) noexcept;
  Hasher& operator=(Hasher&&) noexcept;

  void Update(const void* data, size_t size);
  // Hash of everything since construction or the last Finish.
  std::string Finish();

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

// Whether the text has the form of a blob's name: 64 lower-case hexadecimal digits.
bool IsBlobId(std::string_view text);

}  // namespace skein
