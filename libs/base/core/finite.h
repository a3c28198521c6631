#pragma once

#include <cmath>

namespace skein {

// For messages and JSON, which have no word for infinity.
template <class Float>
Float FiniteOrZero(Float value) {
  return std::isfinite(value) ? value : 0;
}

}  // namespace skein
