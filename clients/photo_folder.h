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
  std::string name;  // relative to the folder; as the file system has it, valid or not
};

// The order in which a folder's photos are sent.
struct PhotoOrder {
  enum class Kind { kName, kTime, kShuffle };
  Kind kind = Kind::kName;
  uint64_t seed = 0;
};

// "name", "time" or "shuffle:SEED".
Result<PhotoOrder> ParsePhotoOrder(const std::string& text);

// Regular files below the folder that end in .jpg, .jpeg, .png, .tif or .tiff in any case. Order by
// time: EXIF's capture time, else the file's, then by name. Throws
// std::filesystem::filesystem_error when a part of the folder cannot be read.
std::vector<PhotoFile> ListPhotos(const std::filesystem::path& folder, const PhotoOrder& order);

// What ListPhotos leaves out. Hidden files are not told: file managers leave them.
struct OtherFiles {
  std::string kinds;       // "12 .heic, 3 .mp4, 1 without an extension", most first; "" if nothing
  bool have_heif = false;  // by their bytes
};
// Throws as ListPhotos does.
OtherFiles FindOtherFiles(const std::filesystem::path& folder);

// For a Publisher: each is read with ReadPhoto.
std::vector<PhotoToOffer> ToOffer(const std::vector<PhotoFile>& photos, int max_size_px);

// The file's bytes. With max_size_px > 0 a larger photo is shrunk to that longest side. It becomes
// a JPEG of quality 95 with the original's EXIF block, pixels as stored. An undecodable file is
// returned as it is: ingest reports what is wrong.
Result<Bytes> ReadPhoto(const std::filesystem::path& path, int max_size_px);

}  // namespace skein
