// Parts of the Check() of an options struct.
#pragma once

#include <initializer_list>
#include <sstream>
#include <stdexcept>
#include <string>

#include "core/result.h"

namespace skein {

// `option`: the key as a config file has it. An error says the value and the range.
template <class T>
Status InRange(const std::string& option, T value, T low, T high) {
  if (value >= low && value <= high) return Status::Ok();
  std::ostringstream text;
  text << option << " is " << value << ": give " << low << " to " << high;
  return InvalidArgument(text.str());
}

inline Status FirstError(std::initializer_list<Status> checks) {
  for (const Status& check : checks) {
    if (!check.ok()) return check;
  }
  return Status::Ok();
}

// For an algorithm that was given options which nobody checked: throws std::invalid_argument.
inline void ThrowUnlessSound(const Status& checked) {
  if (!checked.ok()) throw std::invalid_argument(checked.error());
}

}  // namespace skein
