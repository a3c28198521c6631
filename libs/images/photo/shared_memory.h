#pragma once

#include <cstddef>
#include <cstdint>

#include "core/result.h"

namespace skein {

// Memory that this process shares with a child: a memfd (memfd_create(2)) and its mapping. The
// memory can grow, never shrink (F_SEAL_SHRINK): a child that could cut it would make the parent's
// reads fault.
class SharedMemory {
 public:
  // `name` is shown in /proc.
  static Result<SharedMemory> Make(const char* name);
  ~SharedMemory();
  SharedMemory(SharedMemory&& other) noexcept;
  SharedMemory& operator=(SharedMemory&& other) noexcept;
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

  // Makes room for `size` bytes; data() may move then.
  Status Reserve(size_t size);
  // Gives back the memory behind the first `size` bytes; they read as zeros.
  void Release(size_t size);

  uint8_t* data() const { return data_; }
  size_t capacity() const { return capacity_; }
  int fd() const { return fd_; }

 private:
  explicit SharedMemory(int fd) : fd_(fd) {}

  int fd_ = -1;
  uint8_t* data_ = nullptr;
  size_t capacity_ = 0;
};

}  // namespace skein
