#include "clients/folder_walk.h"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <set>
#include <system_error>
#include <utility>

#include "core/utf8.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 6> kSkippedFolders = {
    "@eadir", "#recycle", "$recycle.bin", "system volume information", "thumbs", "__macosx"};

class Walker {
 public:
  explicit Walker(const fs::path& folder) {
    // A link to a folder above would lead to everything beside the walk's own.
    for (fs::path above = fs::canonical(folder); above.has_relative_path();) {
      above = above.parent_path();
      IsNew(above);
    }
    IsNew(folder);
    Enter(folder, true);
    while (!folders_.empty() || !links_.empty()) EnterNext();
  }

  FolderWalk Take() { return std::move(walk_); }

 private:
  void EnterNext() {
    if (!folders_.empty()) {
      const fs::path folder = std::move(folders_.back());
      folders_.pop_back();
      return Enter(folder, false);
    }
    const fs::path link = *links_.begin();
    links_.erase(links_.begin());
    if (IsNew(link)) return Enter(link, false);
    walk_.repeated.push_back(link);
  }

  bool IsNew(const fs::path& folder) {
    struct stat info {};
    return ::stat(folder.c_str(), &info) == 0 && seen_.emplace(info.st_dev, info.st_ino).second;
  }

  void Enter(const fs::path& folder, bool must_be_readable) {
    std::error_code error;
    fs::directory_iterator entries(folder, error);
    if (error && must_be_readable) throw fs::filesystem_error("cannot read", folder, error);
    if (error == std::errc::permission_denied) walk_.unreadable.push_back(folder);
    for (; !error && entries != fs::directory_iterator(); entries.increment(error)) Sort(*entries);
  }

  void Sort(const fs::directory_entry& entry) {
    std::error_code vanished;
    const fs::path& path = entry.path();
    if (IsSkippedName(path.filename().string())) {
      walk_.skipped.push_back(path);
    } else if (!entry.is_directory(vanished)) {
      if (entry.is_regular_file(vanished)) {
        walk_.files.push_back(path);
      } else if (entry.is_symlink(vanished)) {
        walk_.dangling.push_back(path);
      }
    } else if (entry.is_symlink(vanished)) {
      links_.insert(path);
    } else if (IsNew(path)) {
      folders_.push_back(path);
    }
  }

  FolderWalk walk_;
  std::set<std::pair<dev_t, ino_t>> seen_;
  std::vector<fs::path> folders_;
  std::set<fs::path> links_;  // to folders; after all folders that are none
};

}  // namespace

bool IsSkippedName(const std::string& name) {
  if (!name.empty() && name[0] == '.') return true;
  const std::string lower = LowerCase(name);
  return std::find(kSkippedFolders.begin(), kSkippedFolders.end(), lower) != kSkippedFolders.end();
}

FolderWalk WalkFolder(const fs::path& folder) { return Walker(folder).Take(); }

}  // namespace skein
