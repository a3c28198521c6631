// Decoding of LCM messages that trusts nothing.
#pragma once

#include <cstddef>
#include <exception>
#include <string>
#include <type_traits>

namespace skein {

// False unless the bytes are exactly one T: another type's fingerprint, a short buffer, bytes left
// over, array lengths that cannot be.
template <class T>
bool DecodeMessage(const void* data, size_t size, T* message) {
  try {
    return message->decode(data, 0, static_cast<int>(size)) == static_cast<int>(size);
  } catch (const std::exception&) {  // lcm-gen resizes by lengths it has not checked
    return false;
  }
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

}  // namespace skein
