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

void WalkFolder(const fs::path& folder,
                const std::function<void(const fs::path&, const struct stat&)>& on_entry,
                const std::function<void(const fs::path&, const std::string&)>& on_unread) {
  std::vector<fs::path> folders = {folder};
  const auto cannot_read = [&](const fs::path& path, const std::error_code& error) {
    const bool is_gone =
        error == std::errc::no_such_file_or_directory || error == std::errc::not_a_directory;
    if (!is_gone) on_unread(path, error.message());
  };
  const auto visit = [&](const fs::path& path) {
    struct stat info {};
    if (::lstat(path.c_str(), &info) != 0) {
      return cannot_read(path, {errno, std::generic_category()});
    }
    on_entry(path, info);
    if (S_ISDIR(info.st_mode)) folders.push_back(path);
  };
  while (!folders.empty()) {
    const fs::path next = std::move(folders.back());
    folders.pop_back();
    std::error_code error;
    fs::directory_iterator entry(next, error);
    for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
      visit(entry->path());
    }
    if (error) cannot_read(next, error);
  }
}

std::vector<fs::path> FilesUnder(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  if (!fs::is_directory(fs::symlink_status(folder, error))) return files;
  WalkFolder(
      folder,
      [&](const fs::path& path, const struct stat& info) {
        if (S_ISREG(info.st_mode)) files.push_back(path);
      },
      [](const fs::path&, const std::string&) {});
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace skein
