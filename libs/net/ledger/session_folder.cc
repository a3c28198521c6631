#include "ledger/session_folder.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <random>
#include <system_error>

#include "core/file.h"
#include "core/file_below.h"
#include "core/folder.h"
#include "core/json_depth.h"

namespace skein {
namespace {

constexpr char kSessionIdentifier[] = "skein-session";
constexpr int kSessionVersion = 1;
// It has some 150 bytes and a path.
constexpr size_t kMaxSessionFileBytes = 16 << 10;
constexpr int kMaxDepth = 8;

bool IsSessionId(const std::string& text) {
  return text.size() == 16 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

// It is shown in a terminal.
bool HoldsControls(const std::string& text) {
  return std::any_of(text.begin(), text.end(),
                     [](unsigned char c) { return c < 0x20 || c == 0x7f; });
}

struct SessionFile {
  std::string session_id;
  std::string folder;  // where it was when it was claimed; "" if never
};

Result<SessionFile> ParseSessionFile(const std::string& path, const Bytes& bytes) {
  const auto json = IsShallowJson(bytes, kMaxDepth)
                        ? nlohmann::json::parse(bytes.begin(), bytes.end(), nullptr, false)
                        : nlohmann::json();
  const auto damaged = DataLoss(path + " is damaged; `skein repair` takes the id from the ledger");
  if (!json.is_object() || json.value("identifier", nlohmann::json()) != kSessionIdentifier) {
    return damaged;
  }
  if (json.value("version", nlohmann::json()) != kSessionVersion) {
    return DataLoss(path + " was written by another version of Skein; use that version");
  }
  const auto id = json.value("session_id", nlohmann::json());
  const auto folder = json.value("folder", nlohmann::json(""));
  if (!id.is_string() || !IsSessionId(id.get<std::string>()) || !folder.is_string() ||
      HoldsControls(folder.get<std::string>())) {
    return damaged;
  }
  return SessionFile{id.get<std::string>(), folder.get<std::string>()};
}

Result<SessionFile> ReadSessionFile(const SessionPaths& paths) {
  const std::string path = paths.SessionFile().string();
  const Result<Bytes> bytes = ReadFileBelow(paths.root, path, kMaxSessionFileBytes);
  if (!bytes.ok()) return bytes.status();
  return ParseSessionFile(path, *bytes);
}

Status Write(const SessionPaths& paths, const SessionFile& file) {
  const nlohmann::json json = {{"identifier", kSessionIdentifier},
                               {"version", kSessionVersion},
                               {"session_id", file.session_id},
                               {"folder", file.folder}};
  const std::string text = json.dump(2) + "\n";
  return WriteFileBelow(paths.root, paths.SessionFile(), text.data(), text.size());
}

}  // namespace

Result<Session> OpenSession(const std::filesystem::path& dir) {
  const SessionPaths paths{dir};
  std::error_code error;
  if (!std::filesystem::exists(paths.SessionFile(), error)) {
    return NotFound(
        dir.string() +
        " holds no session (no session.json): give the folder of `skein launch --session`");
  }
  Result<SessionFile> file = ReadSessionFile(paths);
  if (!file.ok()) return file.status();
  return Session{file->session_id, paths};
}

Result<Session> OpenOrCreateSession(const std::filesystem::path& dir) {
  if (Status status = CreateFolders(dir); !status.ok()) return status;
  std::error_code error;
  const FolderLock lock(dir.string());
  const SessionPaths paths{dir};
  if (!std::filesystem::exists(paths.SessionFile(), error)) {
    const Status status = WriteSessionFile(paths, RandomSessionId());
    if (!status.ok()) return status;
  }
  return OpenSession(dir);
}

Status ClaimSession(const Session& session) {
  const FolderLock lock(session.paths.root.string());
  const Result<SessionFile> file = ReadSessionFile(session.paths);
  if (!file.ok()) return file.status();
  std::error_code error;
  const std::string here = std::filesystem::canonical(session.paths.root, error).string();
  if (error) return Unavailable(session.paths.root.string() + ": " + error.message());
  if (here == file->folder) return Status::Ok();
  const SessionPaths before{file->folder};
  const bool is_other =
      !file->folder.empty() && !std::filesystem::equivalent(file->folder, here, error) && !error;
  const Result<SessionFile> other = is_other ? ReadSessionFile(before) : Result<SessionFile>(*file);
  if (is_other && other.ok() && other->session_id == file->session_id) {
    return FailedPrecondition(here + " is a copy of the session in " + file->folder +
                              "; `skein clone` makes a copy that may run");
  }
  return Write(session.paths, {file->session_id, here});
}

Status WriteSessionFile(const SessionPaths& paths, const std::string& session_id) {
  return Write(paths, {session_id, ""});
}

std::string RandomSessionId() {
  std::random_device device;
  char text[17];
  std::snprintf(text, sizeof(text), "%08x%08x", device(), device());
  return text;
}

}  // namespace skein
