// The photos of a folder: which, in what order, and the bytes to send.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/bytes.h"
#include "core/result.h"
#include "node/publisher.h"

namespace skein {

struct PhotoFile {
  std::filesystem::path path;
  std::string name;          // relative to the folder; as the file system has it, valid or not
  bool has_changed = false;  // of FolderWatch: given before, with another size or time
};

// The order in which a folder's photos are sent.
struct PhotoOrder {
  enum class Kind { kName, kTime, kShuffle };
  Kind kind = Kind::kName;
  uint64_t seed = 0;
};

// "name", "time" or "shuffle:SEED".
Result<PhotoOrder> ParsePhotoOrder(const std::string& text);

// Files of the walk (clients/folder_walk.h) that end in .jpg, .jpeg, .png, .tif or .tiff in any
// case, without companions (clients/companions.h). Order by time: EXIF's capture time, else the
// file's, then by name. Throws as WalkFolder does.
std::vector<PhotoFile> ListPhotos(const std::filesystem::path& folder, const PhotoOrder& order);

// Files that ListPhotos leaves out, in words; "" if none.
struct OtherFiles {
  std::string kinds;       // no photos: "12 .heic, 3 .mp4, 1 without an extension", most first
  bool have_heif = false;  // by their bytes
  std::string companions;  // "860 in masks, 12 *_depth.png", most first
  std::string skipped;     // photos: "860 in @eaDir, 12 in .thumbnails, 3 ._*", most first
  std::string repeated;    // links to folders that are read anyway: "up, copies/all"
  std::string dangling;    // links that lead to no file or folder
  std::string unreadable;  // folders
};
// Throws as WalkFolder does.
OtherFiles FindOtherFiles(const std::filesystem::path& folder);

// The file's bytes. With max_size_px > 0 a larger photo is shrunk to that longest side. The shrunk
// photo is a JPEG of quality 95 with the original's EXIF and XMP, pixels as stored. An undecodable
// file is returned as it is: ingest reports what is wrong.
Result<Bytes> ReadPhoto(const std::filesystem::path& path, int max_size_px);

// The same of a file that may be written just now. Error: it does not decode wholly (CheckDecodes),
// as long as something is missing.
Result<Bytes> ReadWholePhoto(const std::filesystem::path& path, int max_size_px);

using PhotoReader = Result<Bytes> (*)(const std::filesystem::path& path, int max_size_px);

// For a Publisher, which calls `read` for each.
std::vector<PhotoToOffer> ToOffer(const std::vector<PhotoFile>& photos, int max_size_px,
                                  PhotoReader read = ReadPhoto);

}  // namespace skein
