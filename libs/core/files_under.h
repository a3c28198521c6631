#pragma once

#include <filesystem>
#include <vector>

namespace skein {

// The regular files below `folder`, at any depth, sorted. What vanishes meanwhile is left out; a
// folder that is absent holds none.
std::vector<std::filesystem::path> FilesUnder(const std::filesystem::path& folder);

}  // namespace skein
