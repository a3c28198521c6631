// Decoding of LCM messages that trusts nothing.
#pragma once

#include <cstddef>
#include <exception>
#include <string>
#include <type_traits>

#include "skein/blob_chunk_t.hpp"
#include "skein/candidates_t.hpp"
#include "skein/matches_t.hpp"
#include "skein/shared_request_t.hpp"
#include "skein/work_request_t.hpp"

namespace skein {

// lcm-gen's decoders allocate before they check an array's length; this checks it against the
// bytes. `before` lists the fields ahead of the length, as LCM encodes them: 's' a string, '8' '4'
// '1' a number of so many bytes.
struct ArrayLayout {
  const char* before;
  size_t element_bytes;  // encoded; 0: the type has no array of variable length
};

template <class T>
inline constexpr ArrayLayout kArrayLayout{"", 0};
template <>
inline constexpr ArrayLayout kArrayLayout<candidates_t>{
    "s88ss8"
    "8",
    8 + 4};
template <>
inline constexpr ArrayLayout kArrayLayout<matches_t>{
    "s88ss8"
    "84",
    8 + 4 + 1 + 4 + 4};
template <>
inline constexpr ArrayLayout kArrayLayout<shared_request_t>{"s888", 8};
template <>
inline constexpr ArrayLayout kArrayLayout<work_request_t>{"ssss44", 8};
template <>
inline constexpr ArrayLayout kArrayLayout<blob_chunk_t>{"ss188", 1};

// Whether the array's length is there and its elements fit into the message.
bool ArrayFits(const void* data, size_t size, const ArrayLayout& layout);

// False unless the bytes are exactly one T. False for another fingerprint, a short buffer, bytes
// left over, impossible lengths.
template <class T>
bool DecodeMessage(const void* data, size_t size, T* message) {
  if (kArrayLayout<T>.element_bytes > 0 && !ArrayFits(data, size, kArrayLayout<T>)) return false;
  try {
    return message->decode(data, 0, static_cast<int>(size)) == static_cast<int>(size);
  } catch (const std::exception&) {  // a string's length that cannot be
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
template <class T>
const std::string& SessionOf(const T& message) {
  return SessionOf(const_cast<T&>(message));
}

}  // namespace skein
