#include "depth/scratch_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <stdexcept>
#include <string>

#include "core/file.h"

namespace skein {
namespace {

constexpr int64_t kAlignment = 64;  // of a copy: a cache line, as OpenCV aligns its own

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int fd() const { return fd_; }

 private:
  const int fd_;
};

Status ScratchError(const std::filesystem::path& folder, int error) {
  return FileError("cannot keep depth maps in", folder.string(), error);
}

Status Allocate(int fd, int64_t bytes, const std::filesystem::path& folder) {
  int error = EINTR;
  while (error == EINTR) error = ::posix_fallocate(fd, 0, bytes);
  if (error == 0) return Status::Ok();
  Status status = ScratchError(folder, error);
  if (error == ENOSPC || error == EDQUOT || error == EFBIG) {
    status.text += ": free " + std::to_string(1 + bytes / 1'000'000) +
                   " MB there, or take a folder on another disk or smaller depth maps";
  }
  return status;
}

}  // namespace

int64_t ScratchFile::BytesFor(int64_t bytes) {
  return (bytes + kAlignment - 1) / kAlignment * kAlignment;
}

Result<std::unique_ptr<ScratchFile>> ScratchFile::Make(const std::filesystem::path& folder,
                                                       int64_t bytes) {
  bytes = std::max(bytes, kAlignment);  // no file of 0 bytes is mapped
  const std::string name = TemporaryName((folder / "depth-maps").string());
  const Descriptor file(::open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
  if (file.fd() < 0) return ScratchError(folder, errno);
  ::unlink(name.c_str());
  if (Status status = Allocate(file.fd(), bytes, folder); !status.ok()) return status;
  void* data =
      ::mmap(nullptr, static_cast<size_t>(bytes), PROT_READ | PROT_WRITE, MAP_SHARED, file.fd(), 0);
  if (data == MAP_FAILED) return ScratchError(folder, errno);
  return std::unique_ptr<ScratchFile>(new ScratchFile(static_cast<uint8_t*>(data), bytes));
}

ScratchFile::~ScratchFile() { ::munmap(data_, static_cast<size_t>(bytes_)); }

cv::Mat ScratchFile::Copy(const cv::Mat& pixels) {
  const int64_t bytes = BytesFor(static_cast<int64_t>(pixels.total() * pixels.elemSize()));
  const int64_t at = used_.fetch_add(bytes);
  if (at + bytes > bytes_) throw std::length_error("a scratch file has no room left");
  cv::Mat copy(pixels.size(), pixels.type(), data_ + at);
  pixels.copyTo(copy);
  return copy;
}

}  // namespace skein
