#include "clients/companions.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <unordered_set>

#include "clients/folder_walk.h"
#include "photo/photo_name.h"

namespace skein {
namespace {

namespace fs = std::filesystem;
using Names = std::unordered_set<std::string>;

constexpr std::array<std::string_view, 8> kSuffixes = {
    "_depth", "-depth", ".depth", "_mask", "-mask", ".mask", "_seg", "_segmentation"};
constexpr std::array<std::string_view, 6> kFolders = {"depth", "depths", "depth_maps",
                                                      "mask",  "masks",  "segmentation"};
constexpr std::array<const char*, 4> kFoldersOfPhotos = {"images", "rgb", "color", "photos"};

bool IsPngOrTiff(const fs::path& path) {
  const std::string extension = LowerCase(path.extension().string());
  return extension == ".png" || extension == ".tif" || extension == ".tiff";
}

bool IsInFolderOfCompanions(const fs::path& path) {
  const std::string folder = LowerCase(path.parent_path().filename().string());
  return std::find(kFolders.begin(), kFolders.end(), folder) != kFolders.end();
}

// In the case in which the stem has it; "" without one, or if nothing is in front of it.
std::string SuffixOf(const std::string& stem) {
  const std::string lower = LowerCase(stem);
  for (const std::string_view suffix : kSuffixes) {
    if (lower.size() <= suffix.size()) continue;
    const size_t at = lower.size() - suffix.size();
    if (lower.compare(at, suffix.size(), suffix) == 0) return stem.substr(at);
  }
  return "";
}

bool MayBeCompanion(const fs::path& path) {
  return IsPngOrTiff(path) &&
         (IsInFolderOfCompanions(path) || !SuffixOf(path.stem().string()).empty());
}

// Of each photo its path, and its path without the extension.
Names NamesOfPhotos(const std::vector<fs::path>& photos) {
  Names names;
  for (const fs::path& photo : photos) {
    names.insert(photo.string());
    names.insert((photo.parent_path() / photo.stem()).string());
  }
  return names;
}

bool IsInOtherFolder(const std::string& name, const fs::path& folder, const Names& photos) {
  const fs::path above = folder.parent_path();
  if (photos.count((above / name).string()) > 0) return true;
  return std::any_of(kFoldersOfPhotos.begin(), kFoldersOfPhotos.end(), [&](const char* sibling) {
    return photos.count((above / sibling / name).string()) > 0;
  });
}

bool IsCompanion(const fs::path& path, const Names& photos) {
  if (!MayBeCompanion(path)) return false;
  const fs::path folder = path.parent_path();
  const std::string stem = path.stem().string();
  if (IsInFolderOfCompanions(path) && IsInOtherFolder(stem, folder, photos)) return true;
  const std::string suffix = SuffixOf(stem);
  if (suffix.empty()) return false;
  const std::string name = stem.substr(0, stem.size() - suffix.size());
  return photos.count((folder / name).string()) > 0 || IsInOtherFolder(name, folder, photos);
}

}  // namespace

std::vector<fs::path> TakeCompanions(std::vector<fs::path>* photos) {
  std::vector<fs::path> companions;
  if (std::none_of(photos->begin(), photos->end(), MayBeCompanion)) return companions;
  const Names names = NamesOfPhotos(*photos);
  const auto first = std::stable_partition(
      photos->begin(), photos->end(), [&](const fs::path& p) { return !IsCompanion(p, names); });
  companions.assign(first, photos->end());
  photos->erase(first, photos->end());
  return companions;
}

std::string KindOfCompanion(const fs::path& companion) {
  if (IsInFolderOfCompanions(companion)) {
    return "in " + Printable(companion.parent_path().filename().string());
  }
  return "*" + Printable(SuffixOf(companion.stem().string()) + companion.extension().string());
}

}  // namespace skein
