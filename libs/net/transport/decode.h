// Decoding of LCM messages that trusts nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <type_traits>

#include "transport/type_layout.h"

namespace skein {

constexpr size_t kFingerprintBytes = 8;  // of a message's type, before its value

// False unless the bytes are exactly one T: its fingerprint, then a value whose lengths fit (see
// type_layout.h), with no bytes left over.
template <class T>
bool DecodeMessage(const void* data, size_t size, T* message) {
  static const TypeLayout& layout = TypeLayout::Of(T::getTypeName());
  if (size < kFingerprintBytes || size > std::numeric_limits<int>::max()) return false;
  const auto* bytes = static_cast<const uint8_t*>(data);
  if (layout.Measure(bytes + kFingerprintBytes, size - kFingerprintBytes) !=
      size - kFingerprintBytes) {
    return false;
  }
  return message->decode(data, 0, static_cast<int>(size)) == static_cast<int>(size);
}

namespace decode_internal {
template <class T, class = void>
struct HasHeader : std::false_type {};
template <class T>
struct HasHeader<T, std::void_t<decltype(T::header)>> : std::true_type {};
}  // namespace decode_internal

// The session a message belongs to; facts hold it in their header.
template <class T>
std::string& SessionOf(T& message) {
  if constexpr (decode_internal::HasHeader<T>::value) {
    return message.header.session_id;
  } else {
    return message.session_id;
  }
}
template <class T>
const std::string& SessionOf(const T& message) {
  return SessionOf(const_cast<T&>(message));
}

}  // namespace skein
