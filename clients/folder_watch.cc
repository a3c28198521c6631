#include "clients/folder_watch.h"

#include <sys/stat.h>

#include <utility>

namespace skein {

void FolderWatch::Skip(const std::vector<PhotoFile>& photos) {
  for (const PhotoFile& photo : photos) {
    File& file = files_[photo.name];
    file.seen = file.given = StampOf(photo.path);
  }
}

std::vector<PhotoFile> FolderWatch::List() {
  try {
    std::vector<PhotoFile> photos = ListPhotos(folder_, order_);
    is_gone_ = false;
    return photos;
  } catch (const std::filesystem::filesystem_error&) {
    is_gone_ = true;
    return {};
  }
}

std::optional<FolderWatch::Stamp> FolderWatch::StampOf(const std::filesystem::path& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) return std::nullopt;
  return Stamp{static_cast<uintmax_t>(info.st_size), info.st_mtim.tv_sec, info.st_mtim.tv_nsec};
}

std::vector<PhotoFile> FolderWatch::Scan() {
  std::vector<PhotoFile> complete;
  for (PhotoFile& photo : List()) {
    const std::optional<Stamp> stamp = StampOf(photo.path);
    File& file = files_[photo.name];
    const bool is_stable = stamp && file.seen == stamp && stamp->size_bytes > 0;
    file.seen = stamp;
    if (!is_stable || file.given == stamp) continue;
    photo.has_changed = file.given.has_value();
    file.given = stamp;
    complete.push_back(std::move(photo));
  }
  return complete;
}

}  // namespace skein
