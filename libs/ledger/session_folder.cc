#include "ledger/session_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <random>
#include <system_error>

#include "core/file.h"

namespace skein {
namespace {

constexpr char kSessionIdentifier[] = "skein-session";
constexpr int kSessionVersion = 1;

std::string RandomSessionId() {
  std::random_device device;
  char text[17];
  std::snprintf(text, sizeof(text), "%08x%08x", device(), device());
  return text;
}

bool IsSessionId(const std::string& text) {
  return text.size() == 16 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

Result<std::string> ParseSessionId(const std::string& path, const Bytes& bytes) {
  const auto json = nlohmann::json::parse(bytes.begin(), bytes.end(), nullptr, false);
  const auto damaged = DataLoss(path + " is damaged; restore it or use another folder");
  if (!json.is_object() || json.value("identifier", nlohmann::json()) != kSessionIdentifier) {
    return damaged;
  }
  if (json.value("version", nlohmann::json()) != kSessionVersion) {
    return DataLoss(path + " was written by another version of Skein; use that version");
  }
  const auto id = json.value("session_id", nlohmann::json());
  if (!id.is_string() || !IsSessionId(id.get<std::string>())) return damaged;
  return id.get<std::string>();
}

Status CreateSessionFile(const std::string& path) {
  const nlohmann::json json = {{"identifier", kSessionIdentifier},
                               {"version", kSessionVersion},
                               {"session_id", RandomSessionId()}};
  const std::string text = json.dump(2) + "\n";
  return WriteFileAtomic(path, text.data(), text.size());
}

// Holds an exclusive lock on a folder while it lives.
class FolderLock {
 public:
  explicit FolderLock(const std::string& dir) : fd_(open(dir.c_str(), O_RDONLY | O_DIRECTORY)) {
    if (fd_ >= 0) flock(fd_, LOCK_EX);
  }
  ~FolderLock() {
    if (fd_ >= 0) close(fd_);
  }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_;
};

}  // namespace

Result<Session> OpenSession(const std::filesystem::path& dir) {
  const SessionPaths paths{dir};
  std::error_code error;
  if (!std::filesystem::exists(paths.SessionFile(), error)) {
    return NotFound(dir.string() + " holds no session (no session.json)");
  }
  const std::string path = paths.SessionFile().string();
  const Result<Bytes> bytes = ReadFile(path);
  if (!bytes.ok()) return bytes.status();
  Result<std::string> id = ParseSessionId(path, *bytes);
  if (!id.ok()) return id.status();
  return Session{*std::move(id), paths};
}

Result<Session> OpenOrCreateSession(const std::filesystem::path& dir) {
  std::error_code error;
  std::filesystem::create_directories(dir, error);
  if (error) return Unavailable("cannot create " + dir.string() + ": " + error.message());
  const FolderLock lock(dir.string());
  const SessionPaths paths{dir};
  if (!std::filesystem::exists(paths.SessionFile(), error)) {
    const Status status = CreateSessionFile(paths.SessionFile().string());
    if (!status.ok()) return status;
  }
  return OpenSession(dir);
}

}  // namespace skein
