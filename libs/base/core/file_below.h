// Files in a folder that somebody else may have filled, as a session folder that was sent. The
// caller trusts `root`, which may be or contain symbolic links, and nothing below it.
//
// `path` is `root` and names below it, as SessionPaths gives it. Each component below `root` is
// opened by itself (openat with O_NOFOLLOW): no symbolic link is followed, ".." is refused. Only
// regular files are opened. A FIFO, a socket or a device is refused without waiting for it.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/bytes.h"
#include "core/result.h"

namespace skein {

// The largest file of any session: a model of 10,000 photos has some 2 GB.
constexpr size_t kMaxStoredFileBytes = size_t{16} << 30;

// Owns a descriptor; -1 is none.
class FileDescriptor {
 public:
  explicit FileDescriptor(int fd = -1) : fd_(fd) {}
  FileDescriptor(FileDescriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~FileDescriptor();
  int get() const { return fd_; }
  // The caller closes it from now on.
  int Release() { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

// `flags` as of open(2). A file that is written in place must have one name: another hard link may
// lie outside of `root`. kInvalidArgument: the path leads through or to what is not opened.
Result<FileDescriptor> OpenFileBelow(const std::filesystem::path& root,
                                     const std::filesystem::path& path, int flags,
                                     mode_t mode = 0644);

// The whole file. kInvalidArgument, too: it has more than `max_bytes`.
Result<Bytes> ReadFileBelow(const std::filesystem::path& root, const std::filesystem::path& path,
                            size_t max_bytes);

// SHA-256 of the file without its last `left_out` bytes, in the form of core/hash.h. Read in
// pieces: a sparse file takes no room on the disk and would take much in memory. kDataLoss: it is
// shorter.
Result<std::string> HashFileBelow(const std::filesystem::path& root,
                                  const std::filesystem::path& path, size_t left_out = 0);

// Whether another library may open `path` by its name: it is absent, or a regular file with one
// name. Opens nothing, as closing a file ends this process's locks on it (fcntl).
Status CheckFileBelow(const std::filesystem::path& root, const std::filesystem::path& path);

// Whether `path` is a regular file that ReadFileBelow would open.
bool IsFileBelow(const std::filesystem::path& root, const std::filesystem::path& path);

// As WriteFileAtomic (core/file.h). The file's folder must exist.
Status WriteFileBelow(const std::filesystem::path& root, const std::filesystem::path& path,
                      const void* data, size_t size, mode_t mode = 0644);
Status WriteFileBelow(const std::filesystem::path& root, const std::filesystem::path& path,
                      const Bytes& bytes);

// Makes `dir` and the folders between it and `root` that are missing, and syncs the entry of each.
// `root` must exist.
Status CreateFoldersBelow(const std::filesystem::path& root, const std::filesystem::path& dir,
                          mode_t mode = 0755);

// rename(2) of a file or a folder; a symbolic link itself is renamed.
Status RenameBelow(const std::filesystem::path& root, const std::filesystem::path& from,
                   const std::filesystem::path& to);

// Copies the regular files under `from`, a file or a folder, to `to` below `to_root`. All other
// entries are left out. Nothing is copied where `from` does not exist.
Status CopyFilesBelow(const std::filesystem::path& root, const std::filesystem::path& from,
                      const std::filesystem::path& to_root, const std::filesystem::path& to,
                      size_t max_bytes);

// An entry that is neither a regular file nor a folder that can be read.
struct OddEntry {
  std::filesystem::path path;
  std::string kind;  // "a symbolic link", "a FIFO", "a socket", "a device", "an entry that ..."
};
// All of them under `root`, sorted by path.
std::vector<OddEntry> OddEntriesUnder(const std::filesystem::path& root);

}  // namespace skein
