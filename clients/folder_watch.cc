#include "clients/folder_watch.h"

#include <system_error>
#include <utility>

namespace skein {

void FolderWatch::Skip(const std::vector<PhotoFile>& photos) {
  for (const PhotoFile& photo : photos) seen_.insert(photo.name);
}

std::vector<PhotoFile> FolderWatch::List() const {
  try {
    return ListPhotos(folder_, order_);
  } catch (const std::filesystem::filesystem_error&) {
    return {};  // it changed while it was read: the next scan sees it
  }
}

std::vector<PhotoFile> FolderWatch::Scan() {
  std::vector<PhotoFile> complete;
  for (PhotoFile& photo : List()) {
    if (seen_.count(photo.name) > 0) continue;
    std::error_code error;
    const uintmax_t size = std::filesystem::file_size(photo.path, error);
    const auto known = sizes_.find(photo.name);
    const bool is_complete = !error && size > 0 && known != sizes_.end() && known->second == size;
    sizes_[photo.name] = size;
    if (!is_complete) continue;
    sizes_.erase(photo.name);
    seen_.insert(photo.name);
    complete.push_back(std::move(photo));
  }
  return complete;
}

}  // namespace skein
