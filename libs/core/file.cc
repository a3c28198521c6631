#include "core/file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>

namespace skein {
namespace {

constexpr char kTemporaryMark[] = ".tmp-";

class FileDescriptor {
 public:
  explicit FileDescriptor(int fd) : fd_(fd) {}
  ~FileDescriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

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

Status SystemError(const std::string& what, const std::string& path) {
  return Status::Error(CodeOf(errno), what + " " + path + ": " + std::strerror(errno));
}

std::string TemporaryName(const std::string& path) {
  static std::atomic<unsigned> counter{0};
  return path + kTemporaryMark + std::to_string(::getpid()) + "-" + std::to_string(counter++);
}

Status WriteAll(int fd, const void* data, size_t size, const std::string& path) {
  const auto* next = static_cast<const uint8_t*>(data);
  while (size > 0) {
    const ssize_t written = ::write(fd, next, size);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return SystemError("cannot write", path);
    next += written;
    size -= static_cast<size_t>(written);
  }
  return Status::Ok();
}

Status WriteTemporary(const std::string& path, const void* data, size_t size, mode_t mode) {
  FileDescriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode));
  if (file.get() < 0) return SystemError("cannot create", path);
  if (Status status = WriteAll(file.get(), data, size, path); !status) return status;
  if (::fsync(file.get()) != 0) return SystemError("cannot sync", path);
  struct stat info;
  if (::fstat(file.get(), &info) != 0) return SystemError("cannot stat", path);
  if (static_cast<size_t>(info.st_size) != size) return Unavailable("short write to " + path);
  return Status::Ok();
}

Status SyncFolderOf(const std::string& path) {
  std::string folder = std::filesystem::path(path).parent_path().string();
  if (folder.empty()) folder = ".";
  FileDescriptor file(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (file.get() < 0) return SystemError("cannot open", folder);
  if (::fsync(file.get()) != 0) return SystemError("cannot sync", folder);
  return Status::Ok();
}

Status Write(const std::string& path, const void* data, size_t size, mode_t mode) {
  const std::string temporary = TemporaryName(path);
  Status status = WriteTemporary(temporary, data, size, mode);
  if (status && ::rename(temporary.c_str(), path.c_str()) != 0) {
    status = SystemError("cannot rename to", path);
  }
  if (!status) {
    ::unlink(temporary.c_str());
    return status;
  }
  return SyncFolderOf(path);
}

}  // namespace

Status WriteFileAtomic(const std::string& path, const void* data, size_t size) {
  return Write(path, data, size, 0644);
}

Status WriteSecretFile(const std::string& path, const void* data, size_t size) {
  return Write(path, data, size, 0600);
}

Status WriteFileAtomic(const std::string& path, const Bytes& bytes) {
  return WriteFileAtomic(path, bytes.data(), bytes.size());
}

bool IsTemporaryName(const std::string& name) {
  return name.find(kTemporaryMark) != std::string::npos;
}

Result<Bytes> ReadFile(const std::string& path) {
  FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0) return SystemError("cannot open", path);
  struct stat info;
  if (::fstat(file.get(), &info) != 0) return SystemError("cannot stat", path);
  if (!S_ISREG(info.st_mode)) return InvalidArgument("not a regular file: " + path);
  Bytes bytes(static_cast<size_t>(info.st_size));
  size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got = ::read(file.get(), bytes.data() + done, bytes.size() - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return SystemError("cannot read", path);
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
