#pragma once

#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <string>

#include "core/result.h"
#include "ledger/session_folder.h"
#include "sfm/camera.h"

namespace skein {

// The pixels of a model's photo, by its name there, as the model has them: 8-bit BGR, not turned by
// EXIF, unmirrored (codecs/image_decoding.h). Valid until the next call. Error: there is no such
// photo, or it does not decode.
using PhotoSource = std::function<Result<cv::Mat3b>(const std::string& name)>;

// The photo `name` of a camera. Error also: it has another size than the camera.
Result<cv::Mat3b> ReadPhoto(const PhotoSource& photos, const std::string& name,
                            const Camera& camera);

// AGENT/NAME of a session. Error: the ledger cannot be read, or there is no decoder.
Result<PhotoSource> PhotosOfSession(const SessionPaths& paths);

// Files below a folder. Error: there is no decoder.
Result<PhotoSource> PhotosOfFolder(const std::filesystem::path& folder);

}  // namespace skein
