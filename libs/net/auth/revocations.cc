#include "auth/revocations.h"

#include <sys/stat.h>

#include <atomic>
#include <mutex>
#include <utility>

#include "auth/keys_file.h"
#include "auth/session_keys.h"
#include "core/file.h"
#include "core/log.h"

namespace skein {
namespace {

constexpr char kRevokedIdentifier[] = "skrevo01";
constexpr char kInvitedIdentifier[] = "skinvi01";
constexpr double kLookS = 1.0;

std::string RevokedPath(const std::string& dir) { return dir + "/revoked"; }
std::string InvitedPath(const std::string& dir) { return dir + "/invited"; }

// "" where it is missing. A file that is rewritten is another inode.
std::string StampOf(const std::string& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) return "";
  return std::to_string(info.st_ino) + " " + std::to_string(info.st_mtim.tv_sec) + " " +
         std::to_string(info.st_mtim.tv_nsec) + " " + std::to_string(info.st_size);
}

Result<std::set<std::string>> ReadNames(const std::string& path, const std::string& identifier) {
  const Result<Bytes> bytes = ReadKeysFile(path, identifier);
  std::set<std::string> names;
  if (bytes.code() == StatusCode::kNotFound) return names;
  if (!bytes.ok()) return bytes.status();
  ByteReader in(*bytes);
  std::string name;
  while (in.GetString(&name)) names.insert(name);
  return names;
}

Status WriteNames(const std::string& path, const std::string& identifier,
                  const std::set<std::string>& names) {
  ByteWriter out;
  for (const std::string& name : names) out.PutString(name);
  return WriteKeysFile(path, identifier, out.Take());
}

// One that is damaged begins again: without it a name is revoked all the same.
InvitedNames InvitedOrNone(const std::string& dir) {
  Result<InvitedNames> names = ReadInvitedNames(dir);
  if (names.ok()) return *std::move(names);
  LogWarn("who was invited before is not known: {}", names.error());
  return {};
}

}  // namespace

Result<RevokedNames> ReadRevokedNames(const std::string& dir) {
  Result<RevokedNames> names = ReadNames(RevokedPath(dir), kRevokedIdentifier);
  if (names.ok()) return names;
  return names.status().Within(
      "who is revoked is not known; restore the file, or delete the folder " + dir +
      " for new keys: all invitations end with the old ones");
}

Result<InvitedNames> ReadInvitedNames(const std::string& dir) {
  return ReadNames(InvitedPath(dir), kInvitedIdentifier);
}

Status RecordInvitation(const std::string& dir, const std::string& name) {
  if (Status status = MakeKeysFolder(dir); !status) return status;
  const FolderLock lock(dir);
  const Result<RevokedNames> revoked = ReadRevokedNames(dir);
  if (!revoked.ok()) return revoked.status();
  if (revoked->count(name) > 0) {
    return InvalidArgument("\"" + name + "\" was revoked: give the next one another name");
  }
  if (HasCredentialOf(dir, name)) {
    return InvalidArgument("\"" + name +
                           "\" is a process of this host: give who is invited another name");
  }
  InvitedNames invited = InvitedOrNone(dir);
  if (!invited.insert(name).second) return Status::Ok();
  return WriteNames(InvitedPath(dir), kInvitedIdentifier, invited);
}

Status RevokeName(const std::string& dir, const std::string& name) {
  const FolderLock lock(dir);
  if (HasCredentialOf(dir, name) && InvitedOrNone(dir).count(name) == 0) {
    return InvalidArgument("\"" + name + "\" is a process of this host, no invitation");
  }
  Result<RevokedNames> names = ReadRevokedNames(dir);
  if (!names.ok()) return names.status();
  names->insert(name);
  return WriteNames(RevokedPath(dir), kRevokedIdentifier, *names);
}

void RevokedList::Refresh() {
  const std::string stamp = StampOf(RevokedPath(dir_));
  if (stamp == read_as_) return;
  Result<RevokedNames> names = ReadRevokedNames(dir_);
  if (names.ok()) {
    names_ = *std::move(names);
  } else {
    LogError("{}", names.error());
  }
  read_as_ = stamp;
}

Revocations::Revocations(std::string dir, Clock clock)
    : list_(std::move(dir)), clock_(std::move(clock)) {}

bool Revocations::operator()(const std::string& name) {
  const double now_s = clock_();
  if (now_s >= next_look_s_) {
    next_look_s_ = now_s + kLookS;
    list_.Refresh();
  }
  return list_.names().count(name) > 0;
}

struct WatchedRevocations::Known {
  explicit Known(const std::string& dir) : list(dir) {}

  std::atomic<bool> looking{false};
  RevokedList list;  // of who looks
  std::mutex mutex;
  RevokedNames names;  // guarded by mutex
};

WatchedRevocations::WatchedRevocations(const std::string& dir, RunJob run_job)
    : run_job_(std::move(run_job)), known_(std::make_shared<Known>(dir)) {
  known_->list.Refresh();
  known_->names = known_->list.names();
}

void WatchedRevocations::Look() {
  if (known_->looking.exchange(true)) return;
  run_job_([known = known_] {
    known->list.Refresh();
    {
      const std::lock_guard<std::mutex> lock(known->mutex);
      known->names = known->list.names();
    }
    known->looking = false;
  });
}

bool WatchedRevocations::operator()(const std::string& name) const {
  const std::lock_guard<std::mutex> lock(known_->mutex);
  return known_->names.count(name) > 0;
}

}  // namespace skein
