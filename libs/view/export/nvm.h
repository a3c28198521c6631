#pragma once

#include <filesystem>

#include "core/result.h"
#include "sfm/reconstruction.h"

namespace skein {

// Largest difference between NVM's distortion and the camera's, as a share of the photo's longer
// side.
inline constexpr double kMaxNvmError = 0.002;

// VisualSFM's NVM_V3 (ccwu.me/vsfm/doc.html#nvm): one model. A measurement is in pixels from the
// principal point, which readers take for the middle of the photo. With m the measurement divided
// by the focal length, the format's only distortion parameter r gives the undistorted
// (1 + r |m|^2) m. r is fitted to the camera's distortion, which goes the other way, over the
// photo. Names are written as they are: blanks part fields. Error: a camera whose distortion is off
// by more than kMaxNvmError anywhere in the photo, or which ExpectSimpleCamera refuses; or the file
// cannot be written.
Status WriteNvmFile(const Reconstruction& model, const std::filesystem::path& file);

}  // namespace skein
