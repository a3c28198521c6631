#include "auth/keys_file.h"

#include <filesystem>

#include "core/file_below.h"
#include "core/hash.h"

namespace skein {
namespace {

// Counters of some 200,000 signers.
constexpr size_t kMaxBytes = 16 << 20;

std::filesystem::path SessionOf(const std::filesystem::path& file) {
  return file.parent_path().parent_path();
}

}  // namespace

Status WriteSecretFile(const std::string& path, const void* data, size_t size) {
  return WriteFileBelow(SessionOf(path), path, data, size, 0600);
}

Result<Bytes> ReadSecretFile(const std::string& path) {
  return ReadFileBelow(SessionOf(path), path, kMaxBytes);
}

Status WriteKeysFile(const std::string& path, const std::string& identifier, const Bytes& content) {
  ByteWriter out;
  out.PutRaw(identifier.data(), identifier.size());
  out.PutRaw(content.data(), content.size());
  const std::string hash = HashBytes(out.bytes().data(), out.size());
  out.PutRaw(hash.data(), hash.size());
  return WriteSecretFile(path, out.bytes().data(), out.size());
}

Result<Bytes> ReadKeysFile(const std::string& path, const std::string& identifier) {
  const Result<Bytes> bytes = ReadSecretFile(path);
  if (bytes.code() == StatusCode::kNotFound) return NotFound(path + " is missing");
  if (!bytes.ok()) return bytes.status();
  const std::string text(bytes->begin(), bytes->end());
  const bool is_whole =
      text.size() >= identifier.size() + kHashSize &&
      text.compare(0, identifier.size(), identifier) == 0 &&
      HashBytes(text.data(), text.size() - kHashSize) == text.substr(text.size() - kHashSize);
  if (!is_whole) return DataLoss(path + " is damaged");
  return Bytes(text.begin() + static_cast<std::ptrdiff_t>(identifier.size()),
               text.end() - static_cast<std::ptrdiff_t>(kHashSize));
}

}  // namespace skein
