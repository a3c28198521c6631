// The photos that appear in a folder while it is watched.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "clients/photo_folder.h"

namespace skein {

// Each content of a file once, as far as its size and time of change tell: when both are the same
// in two scans, and the file is not empty. A copy that pauses is given too early; the reader tells
// that (ReadWholePhoto), and the file is given again when it has gone on.
class FolderWatch {
 public:
  FolderWatch(std::filesystem::path folder, PhotoOrder order)
      : folder_(std::move(folder)), order_(order) {}

  // Treats `photos` as given, with their present size and time.
  void Skip(const std::vector<PhotoFile>& photos);

  // Photos that became complete since the last scan, also those that changed after they were given.
  std::vector<PhotoFile> Scan();

  // By the last scan: there is no such folder, or it may not be read.
  bool is_gone() const { return is_gone_; }

 private:
  struct Stamp {
    uintmax_t size_bytes = 0;
    int64_t changed_s = 0, changed_ns = 0;

    bool operator==(const Stamp& other) const {
      return size_bytes == other.size_bytes && changed_s == other.changed_s &&
             changed_ns == other.changed_ns;
    }
  };
  struct File {
    std::optional<Stamp> seen;   // in the last scan
    std::optional<Stamp> given;  // when it was given last
  };

  std::vector<PhotoFile> List();
  static std::optional<Stamp> StampOf(const std::filesystem::path& path);

  const std::filesystem::path folder_;
  const PhotoOrder order_;
  std::map<std::string, File> files_;  // by name
  bool is_gone_ = false;
};

}  // namespace skein
