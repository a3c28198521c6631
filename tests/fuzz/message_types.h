// All types of lcmtypes/, as a tuple.
#pragma once

#include <utility>

#include "skein/all_types.h"

namespace skein::fuzz {

inline constexpr size_t kNumMessageTypes = std::tuple_size_v<AllTypes>;

// Calls fn(T()) with the type of that number.
template <class Fn, size_t... kTypes>
void WithMessageType(size_t number, Fn fn, std::index_sequence<kTypes...>) {
  ((number == kTypes ? fn(std::tuple_element_t<kTypes, AllTypes>()) : void()), ...);
}
template <class Fn>
void WithMessageType(size_t number, Fn fn) {
  WithMessageType(number, fn, std::make_index_sequence<kNumMessageTypes>());
}

}  // namespace skein::fuzz
