#pragma once

#include <filesystem>
#include <string>

namespace skein {

// The path, or with "~2", "~3", ... behind it the first that nothing is at.
inline std::filesystem::path FreeName(const std::filesystem::path& wanted) {
  std::filesystem::path name = wanted;
  for (int number = 2; std::filesystem::exists(std::filesystem::symlink_status(name)); ++number) {
    name = wanted.string() + "~" + std::to_string(number);
  }
  return name;
}

}  // namespace skein
