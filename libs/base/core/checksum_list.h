// A list of files with their SHA-256, as sha256sum writes and checks it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"

namespace skein {

// Lists the files, and those in the folders, under `paths` (relative to `root`) in root/list_name.
// The files must not change meanwhile.
Status WriteChecksumList(const std::filesystem::path& root, const std::string& list_name,
                         const std::vector<std::string>& paths);

// A line for each listed file that is missing or differs. NotFound where there is no list; DataLoss
// where the list itself is damaged.
Result<std::vector<std::string>> CheckChecksumList(const std::filesystem::path& root,
                                                   const std::string& list_name);

}  // namespace skein
