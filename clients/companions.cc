#include "clients/companions.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <unordered_set>

#include "core/utf8.h"
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
constexpr std::array<std::string_view, 6> kSuffixesOfPhotos = {"_color", "-color", ".color",
                                                               "_rgb",   "-rgb",   ".rgb"};

bool IsPngOrTiff(const fs::path& path) {
  const std::string extension = LowerCase(path.extension().string());
  return extension == ".png" || extension == ".tif" || extension == ".tiff";
}

bool IsInFolderOfCompanions(const fs::path& path) {
  const std::string folder = LowerCase(path.parent_path().filename().string());
  return std::find(kFolders.begin(), kFolders.end(), folder) != kFolders.end();
}

// In the case in which the stem has it; "" without one, or if nothing is in front of it.
template <size_t N>
std::string SuffixOf(const std::string& stem, const std::array<std::string_view, N>& suffixes) {
  const std::string lower = LowerCase(stem);
  for (const std::string_view suffix : suffixes) {
    if (lower.size() <= suffix.size()) continue;
    const size_t at = lower.size() - suffix.size();
    if (lower.compare(at, suffix.size(), suffix) == 0) return stem.substr(at);
  }
  return "";
}

bool MayBeCompanion(const fs::path& path) {
  return IsPngOrTiff(path) &&
         (IsInFolderOfCompanions(path) || !SuffixOf(path.stem().string(), kSuffixes).empty());
}

std::string WithoutSuffix(const std::string& stem, const std::string& suffix) {
  return stem.substr(0, stem.size() - suffix.size());
}

// A photo has three names: its path, that without the extension, and without a photo's suffix, too.
Names NamesOfPhotos(const std::vector<fs::path>& photos) {
  Names names;
  for (const fs::path& photo : photos) {
    names.insert(photo.string());
    const std::string stem = photo.stem().string();
    names.insert((photo.parent_path() / stem).string());
    const std::string suffix = SuffixOf(stem, kSuffixesOfPhotos);
    names.insert((photo.parent_path() / WithoutSuffix(stem, suffix)).string());
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
  const std::string suffix = SuffixOf(stem, kSuffixes);
  if (suffix.empty()) return false;
  const std::string name = WithoutSuffix(stem, suffix);
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
  return "*" +
         Printable(SuffixOf(companion.stem().string(), kSuffixes) + companion.extension().string());
}

}  // namespace skein
