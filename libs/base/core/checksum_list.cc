#include "core/checksum_list.h"

#include <sstream>

#include "core/file_below.h"
#include "core/folder.h"
#include "core/hash.h"

namespace skein {

namespace fs = std::filesystem;

namespace {

// sha256sum puts two spaces between a hash and its file.
constexpr size_t kGapSize = 2;
constexpr size_t kMaxListBytes = 16 << 20;

// Relative to `root`: the file, or all below the folder.
std::vector<std::string> FilesOf(const fs::path& root, const std::string& path) {
  if (!fs::is_directory(fs::symlink_status(root / path))) return {path};
  std::vector<std::string> files;
  for (const fs::path& file : FilesUnder(root / path)) {
    files.push_back(file.lexically_relative(root).string());
  }
  return files;
}

bool IsDamaged(const fs::path& root, const std::string& file, const std::string& hash) {
  const Result<std::string> found = HashFileBelow(root, root / file);
  return !found.ok() || *found != hash;
}

}  // namespace

Status WriteChecksumList(const fs::path& root, const std::string& list_name,
                         const std::vector<std::string>& paths) {
  std::string list;
  for (const std::string& path : paths) {
    for (const std::string& file : FilesOf(root, path)) {
      const Result<std::string> hash = HashFileBelow(root, root / file);
      if (!hash.ok()) return hash.status();
      list += *hash + "  " + file + "\n";
    }
  }
  return WriteFileBelow(root, root / list_name, list.data(), list.size());
}

Result<std::vector<std::string>> CheckChecksumList(const fs::path& root,
                                                   const std::string& list_name) {
  const fs::path path = root / list_name;
  const Result<Bytes> bytes = ReadFileBelow(root, path, kMaxListBytes);
  if (bytes.code() == StatusCode::kNotFound) return NotFound("there is no " + path.string());
  if (!bytes.ok()) return bytes.status();
  std::istringstream lines(std::string(bytes->begin(), bytes->end()));
  std::vector<std::string> damaged;
  for (std::string line; std::getline(lines, line);) {
    const std::string hash = line.substr(0, kHashSize);
    if (line.size() <= kHashSize + kGapSize || !IsBlobId(hash)) {
      return DataLoss(path.string() + " is damaged");
    }
    const std::string file = line.substr(kHashSize + kGapSize);
    if (IsDamaged(root, file, hash)) damaged.push_back(file);
  }
  return damaged;
}

}  // namespace skein
