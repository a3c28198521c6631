// Byte buffers and bounds-checked little-endian reading and writing of them.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace skein {

using Bytes = std::vector<uint8_t>;

#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "Skein's file formats are little endian, and so must be the host"
#endif

// Appends to a buffer of its own.
class ByteWriter {
 public:
  template <class T>
  void Put(const T& value) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    PutRaw(&value, sizeof(T));
  }
  // Size as uint32, then the bytes.
  void PutString(std::string_view text) {
    Put(static_cast<uint32_t>(text.size()));
    PutRaw(text.data(), text.size());
  }
  // Size as uint64, then the bytes.
  void PutBytes(const Bytes& bytes) {
    Put(static_cast<uint64_t>(bytes.size()));
    PutRaw(bytes.data(), bytes.size());
  }
  // The bytes alone.
  void PutRaw(const void* data, size_t size) {
    if (size == 0) return;
    const auto* first = static_cast<const uint8_t*>(data);
    bytes_.insert(bytes_.end(), first, first + size);
  }

  size_t size() const { return bytes_.size(); }
  const Bytes& bytes() const { return bytes_; }
  // Moves the buffer out; the writer is empty then.
  Bytes Take() { return std::exchange(bytes_, {}); }

 private:
  Bytes bytes_;
};

// Reads a buffer that must outlive it. When the buffer is too short a Get returns false and changes
// nothing. Sizes in the data are checked against the bytes that are left.
class ByteReader {
 public:
  ByteReader(const void* data, size_t size)
      : next_(static_cast<const uint8_t*>(data)), remaining_(size) {}
  explicit ByteReader(const Bytes& bytes) : ByteReader(bytes.data(), bytes.size()) {}

  template <class T>
  bool Get(T* value) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    return GetRaw(value, sizeof(T));
  }
  bool GetString(std::string* text) {
    uint32_t size = 0;
    if (!PeekSize(&size)) return false;
    Skip(sizeof(size));
    text->assign(reinterpret_cast<const char*>(next_), size);
    return Skip(size);
  }
  bool GetBytes(Bytes* bytes) {
    uint64_t size = 0;
    if (!PeekSize(&size)) return false;
    Skip(sizeof(size));
    bytes->assign(next_, next_ + size);
    return Skip(size);
  }
  bool GetRaw(void* data, size_t size) {
    if (size > remaining_) return false;
    if (size > 0) std::memcpy(data, next_, size);
    return Skip(size);
  }
  bool Skip(size_t size) {
    if (size > remaining_) return false;
    if (size > 0) next_ += size;
    remaining_ -= size;
    return true;
  }

  size_t remaining() const { return remaining_; }
  // First byte not yet read.
  const uint8_t* data() const { return next_; }

 private:
  // Reads a length prefix without consuming it; false unless as many bytes follow.
  template <class Size>
  bool PeekSize(Size* size) const {
    if (remaining_ < sizeof(Size)) return false;
    std::memcpy(size, next_, sizeof(Size));
    return *size <= remaining_ - sizeof(Size);
  }

  const uint8_t* next_;
  size_t remaining_;
};

}  // namespace skein
