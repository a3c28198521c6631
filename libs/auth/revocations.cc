#include "auth/revocations.h"

#include <sys/stat.h>

#include <utility>

#include "auth/keys_file.h"
#include "auth/session_keys.h"
#include "core/file.h"
#include "core/log.h"

namespace skein {
namespace {

constexpr char kRevokedIdentifier[] = "skrevo01";
constexpr double kLookS = 1.0;

std::string PathIn(const std::string& dir) { return dir + "/revoked"; }

// "" where it is missing. A file that is written anew is another inode.
std::string StampOf(const std::string& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) return "";
  return std::to_string(info.st_ino) + " " + std::to_string(info.st_mtim.tv_sec) + " " +
         std::to_string(info.st_mtim.tv_nsec) + " " + std::to_string(info.st_size);
}

Status Write(const std::string& dir, const RevokedNames& names) {
  ByteWriter out;
  for (const std::string& name : names) out.PutString(name);
  return WriteKeysFile(PathIn(dir), kRevokedIdentifier, out.Take());
}

}  // namespace

Result<RevokedNames> ReadRevokedNames(const std::string& dir) {
  const Result<Bytes> bytes = ReadKeysFile(PathIn(dir), kRevokedIdentifier);
  if (bytes.code() == StatusCode::kNotFound) return RevokedNames{};
  if (!bytes.ok()) {
    return bytes.status().Within(
        "who is revoked is not known; restore the file, or delete the folder " + dir +
        " for new keys: all invitations end with the old ones");
  }
  RevokedNames names;
  ByteReader in(*bytes);
  std::string name;
  while (in.GetString(&name)) names.insert(name);
  return names;
}

Status RequireUnrevoked(const std::string& dir, const std::string& name) {
  const Result<RevokedNames> revoked = ReadRevokedNames(dir);
  if (!revoked.ok()) return revoked.status();
  if (revoked->count(name) == 0) return Status::Ok();
  return InvalidArgument("\"" + name + "\" was revoked: give the next one another name");
}

Status RevokeName(const std::string& dir, const std::string& name) {
  if (HasCredentialOf(dir, name)) {
    return InvalidArgument("\"" + name + "\" is a process of this host, no invitation");
  }
  const FolderLock lock(dir);
  Result<RevokedNames> names = ReadRevokedNames(dir);
  if (!names.ok()) return names.status();
  names->insert(name);
  return Write(dir, *names);
}

Revocations::Revocations(std::string dir, Clock clock)
    : dir_(std::move(dir)), clock_(std::move(clock)) {}

bool Revocations::operator()(const std::string& name) {
  const double now_s = clock_();
  if (now_s >= next_look_s_) {
    next_look_s_ = now_s + kLookS;
    Refresh();
  }
  return names_.count(name) > 0;
}

void Revocations::Refresh() {
  const std::string stamp = StampOf(PathIn(dir_));
  if (stamp == read_as_) return;
  Result<RevokedNames> names = ReadRevokedNames(dir_);
  if (names.ok()) {
    names_ = *std::move(names);
  } else {
    LogError("{}", names.error());
  }
  read_as_ = stamp;
}

}  // namespace skein
