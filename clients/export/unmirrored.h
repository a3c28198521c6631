#pragma once

#include <filesystem>

#include "core/result.h"
#include "ledger/session_folder.h"

namespace skein {

// Models and features are of photos as their camera saw them. A photo whose EXIF orientation says
// that it is stored as a mirror image (photo/exif.h) is flipped left to right for that, but not in
// images/, and other programs do not flip it. Writes such photos flipped and without EXIF to
// `folder`/AGENT/NAME. Returns how many there are; without any it makes no folder. Error: the
// ledger cannot be read, there is no decoder, or a photo is lost.
Result<int> WriteUnmirrored(const SessionPaths& paths, const std::filesystem::path& folder);

}  // namespace skein
