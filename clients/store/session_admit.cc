#include "clients/store/session_admit.h"

#include <fcntl.h>
#include <sys/file.h>

#include <system_error>

#include "auth/session_keys.h"
#include "clients/store/free_name.h"
#include "core/file_below.h"
#include "core/folder.h"

namespace skein {

namespace fs = std::filesystem;

namespace {

Status Refused(const SessionPaths& paths, const fs::path& path, const std::string& what) {
  return InvalidArgument(path.string() + " is " + what +
                         ", which a session does not hold: `skein repair " + paths.root.string() +
                         "` takes it out, `skein clone` copies the session without it");
}

Status CheckEntries(const SessionPaths& paths) {
  const std::vector<OddEntry> odd = OddEntriesUnder(paths.root);
  if (!odd.empty()) return Refused(paths, odd.front().path, odd.front().kind);
  for (const char* folder : {"log", "run"}) {
    for (const fs::path& file : FilesUnder(paths.root / folder)) {
      std::error_code vanished;
      const bool has_second_name = fs::hard_link_count(file, vanished) > 1 && !vanished;
      if (has_second_name) return Refused(paths, file, "a file with a second name");
    }
  }
  return Status::Ok();
}

// launch.sh holds the lock while it runs.
Status CheckNobodyRuns(const SessionPaths& paths) {
  const fs::path lock = paths.root / "run" / "launch.lock";
  const Result<FileDescriptor> file = OpenFileBelow(paths.root, lock, O_RDWR);
  if (file.code() == StatusCode::kNotFound) return Status::Ok();
  if (!file.ok()) return file.status();
  if (::flock(file->get(), LOCK_EX | LOCK_NB) == 0) return Status::Ok();
  return FailedPrecondition("another skein launch runs on " + paths.root.string());
}

Result<std::vector<std::string>> Adopt(const SessionPaths& paths) {
  if (Status free = CheckNobodyRuns(paths); !free.ok()) return free;
  const fs::path aside = FreeName(paths.root / "damaged" / "keys");
  Status status = CreateFoldersBelow(paths.root, aside.parent_path());
  if (status.ok()) status = RenameBelow(paths.root, paths.Keys(), aside);
  if (!status.ok()) return status;
  for (const fs::path& folder : {paths.Retrieval(), paths.root / "run"}) {
    std::error_code error;
    fs::remove_all(folder, error);
    if (error) return Unavailable("cannot remove " + folder.string() + ": " + error.message());
  }
  return std::vector<std::string>{"the session is adopted: keys/ is " +
                                  aside.lexically_relative(paths.root).string() +
                                  " now, the services make new keys; invite anew"};
}

}  // namespace

Result<std::vector<std::string>> AdmitSession(const SessionPaths& paths, bool adopt) {
  std::error_code error;
  if (!fs::exists(paths.root, error) && !error) return std::vector<std::string>{};
  if (Status entries = CheckEntries(paths); !entries.ok()) return entries;
  const Status own = CheckRootIsOwn(paths.Keys().string());
  const bool are_foreign =
      own.code == StatusCode::kFailedPrecondition || own.code == StatusCode::kDataLoss;
  if (adopt && are_foreign) return Adopt(paths);
  if (!own.ok()) return own;
  return std::vector<std::string>{};
}

}  // namespace skein
