#pragma once

#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <string>

#include "core/result.h"
#include "ledger/session_folder.h"
#include "sfm/camera.h"

namespace skein {

// Photo of a model by its name in the model, 8-bit BGR. The pixels are as stored: EXIF's rotation
// is not applied, mirror images are flipped back (codecs/image_decoding.h). The pixels are valid
// until the next call. Error: no such photo, or the photo does not decode.
using PhotoSource = std::function<Result<cv::Mat3b>(const std::string& name)>;

// Reads the photo `name`. Error also: the photo and `camera` differ in size.
Result<cv::Mat3b> ReadPhoto(const PhotoSource& photos, const std::string& name,
                            const Camera& camera);

// AGENT/NAME of a session. Error: the ledger cannot be read, or there is no decoder.
Result<PhotoSource> PhotosOfSession(const SessionPaths& paths);

// Files below a folder. Error: there is no decoder.
Result<PhotoSource> PhotosOfFolder(const std::filesystem::path& folder);

}  // namespace skein
