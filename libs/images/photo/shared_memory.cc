#include "photo/shared_memory.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace skein {
namespace {

constexpr size_t kPage = 4096;

Status MemoryError(const char* what) {
  return Unavailable(std::string("no shared memory for photos (") + what +
                     "): " + std::strerror(errno));
}

}  // namespace

Result<SharedMemory> SharedMemory::Make(const char* name) {
  SharedMemory memory(memfd_create(name, MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (memory.fd_ < 0) return MemoryError("memfd_create");
  if (fcntl(memory.fd_, F_ADD_SEALS, F_SEAL_SHRINK) != 0) return MemoryError("F_ADD_SEALS");
  return memory;
}

SharedMemory::SharedMemory(SharedMemory&& other) noexcept { *this = std::move(other); }

SharedMemory& SharedMemory::operator=(SharedMemory&& other) noexcept {
  std::swap(fd_, other.fd_);
  std::swap(data_, other.data_);
  std::swap(capacity_, other.capacity_);
  return *this;
}

SharedMemory::~SharedMemory() {
  if (data_ != nullptr) munmap(data_, capacity_);
  if (fd_ >= 0) close(fd_);
}

Status SharedMemory::Reserve(size_t size) {
  if (size <= capacity_) return Status::Ok();
  size = (size + kPage - 1) / kPage * kPage;
  if (ftruncate(fd_, static_cast<off_t>(size)) != 0) return MemoryError("ftruncate");
  void* mapped = data_ == nullptr ? mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, fd_, 0)
                                  : mremap(data_, capacity_, size, MREMAP_MAYMOVE);
  if (mapped == MAP_FAILED) return MemoryError("mmap");
  data_ = static_cast<uint8_t*>(mapped);
  capacity_ = size;
  return Status::Ok();
}

void SharedMemory::Release(size_t size) {
  size = (size + kPage - 1) / kPage * kPage;
  if (size >= capacity_) return;
  fallocate(fd_, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, static_cast<off_t>(size),
            static_cast<off_t>(capacity_ - size));
}

}  // namespace skein
