// The photos that appear in a folder while it is watched.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "clients/photo_folder.h"

namespace skein {

// Each photo once, when it is complete: not empty, and of the same size in two scans.
class FolderWatch {
 public:
  FolderWatch(std::filesystem::path folder, PhotoOrder order)
      : folder_(std::move(folder)), order_(order) {}

  // These are known already.
  void Skip(const std::vector<PhotoFile>& photos);

  // Photos that became complete since the last scan.
  std::vector<PhotoFile> Scan();

 private:
  std::vector<PhotoFile> List() const;

  const std::filesystem::path folder_;
  const PhotoOrder order_;
  std::set<std::string> seen_;              // by name
  std::map<std::string, uintmax_t> sizes_;  // of those that are not complete yet
};

}  // namespace skein
