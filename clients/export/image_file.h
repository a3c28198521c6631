#pragma once

#include <filesystem>
#include <opencv2/core.hpp>

#include "core/result.h"

namespace skein {

// Writes the image in the format of the path's extension, JPEG with a quality of 95. The file
// appears when it is whole. Error: OpenCV has no such format, or the file cannot be written.
Status WriteImage(const cv::Mat& image, const std::filesystem::path& path);

}  // namespace skein
