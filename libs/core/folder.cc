#include "core/folder.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>

namespace skein {

namespace fs = std::filesystem;

namespace {

Status Synced(const fs::path& path, int (*sync)(int)) {
  const int fd = open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  const int failed = fd >= 0 && sync(fd) == 0 ? 0 : errno;
  if (fd >= 0) close(fd);
  if (failed == 0) return Status::Ok();
  return Unavailable("cannot sync " + path.string() + ": " + std::strerror(failed));
}

}  // namespace

Status SyncFolder(const fs::path& dir) { return Synced(dir, fsync); }

Status CreateFolders(const fs::path& dir) {
  std::error_code error;
  if (dir.empty() || fs::is_directory(dir, error)) return Status::Ok();
  const fs::path parent = dir.has_filename() ? dir.parent_path() : dir.parent_path().parent_path();
  if (Status status = CreateFolders(parent); !status.ok()) return status;
  fs::create_directory(dir, error);
  if (error) return Unavailable("cannot create " + dir.string() + ": " + error.message());
  return SyncFolder(parent.empty() ? fs::path(".") : parent);
}

Status SyncFileSystem(const fs::path& path) { return Synced(path, syncfs); }

std::vector<fs::path> FilesUnder(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  if (!fs::is_directory(fs::symlink_status(folder, error))) return files;
  fs::recursive_directory_iterator entry(folder, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    std::error_code vanished;
    if (fs::is_regular_file(entry->symlink_status(vanished))) files.push_back(entry->path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace skein
