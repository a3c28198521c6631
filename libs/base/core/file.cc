#include "core/file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "core/file_below.h"

namespace skein {
namespace {

constexpr char kTemporaryMark[] = ".tmp-";

StatusCode CodeOf(int error) {
  switch (error) {
    case ENOENT:
      return StatusCode::kNotFound;
    case EEXIST:
      return StatusCode::kAlreadyExists;
    case ENOSPC:
    case EDQUOT:
    case EMFILE:
    case ENFILE:
      return StatusCode::kResourceExhausted;
    default:
      return StatusCode::kUnavailable;
  }
}

}  // namespace

Status FileError(const std::string& what, const std::string& path, int error) {
  return Status::Error(CodeOf(error), what + " " + path + ": " + std::strerror(error));
}

std::string TemporaryName(const std::string& path) {
  static std::atomic<unsigned> counter{0};
  return path + kTemporaryMark + std::to_string(::getpid()) + "-" + std::to_string(counter++);
}

Status WriteFileAtomic(const std::string& path, const void* data, size_t size) {
  return WriteFileBelow(std::filesystem::path(path).parent_path(), path, data, size);
}

Status WriteFileAtomic(const std::string& path, const Bytes& bytes) {
  return WriteFileAtomic(path, bytes.data(), bytes.size());
}

Status WriteFileAtomic(const std::string& path, const std::string& text) {
  return WriteFileAtomic(path, text.data(), text.size());
}

bool IsTemporaryName(const std::string& name) {
  return name.find(kTemporaryMark) != std::string::npos;
}

Result<Bytes> ReadFile(const std::string& path, size_t max_bytes) {
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  if (file.get() < 0) return FileError("cannot open", path, errno);
  return ReadDescriptor(file.get(), path, max_bytes);
}

Result<Bytes> ReadDescriptor(int fd, const std::string& path, size_t max_bytes) {
  struct stat info {};
  if (::fstat(fd, &info) != 0) return FileError("cannot stat", path, errno);
  if (!S_ISREG(info.st_mode)) return InvalidArgument("not a regular file: " + path);
  if (static_cast<size_t>(info.st_size) > max_bytes) {
    return InvalidArgument(path + " has " + std::to_string(info.st_size) + " bytes, more than " +
                           std::to_string(max_bytes));
  }
  Bytes bytes(static_cast<size_t>(info.st_size));
  size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got = ::read(fd, bytes.data() + done, bytes.size() - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return FileError("cannot read", path, errno);
    if (got == 0) return DataLoss("file shrank while it was read: " + path);
    done += static_cast<size_t>(got);
  }
  return bytes;
}

FolderLock::FolderLock(const std::string& dir)
    : fd_(::open(dir.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (fd_ >= 0) ::flock(fd_, LOCK_EX);
}

FolderLock::~FolderLock() {
  if (fd_ >= 0) ::close(fd_);
}

}  // namespace skein
