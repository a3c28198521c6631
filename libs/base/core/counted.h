#pragma once

#include <cstdint>
#include <string>

namespace skein {

// "1 photo", "2 photos".
inline std::string Counted(int64_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

}  // namespace skein
