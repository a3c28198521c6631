#include "clients/export/image_file.h"

#include <opencv2/imgcodecs.hpp>

#include "codecs/photo_encoding.h"
#include "core/file.h"

namespace skein {

Status WriteImage(const cv::Mat& image, const std::filesystem::path& path) {
  Bytes encoded;
  if (!cv::imencode(path.extension().string(), image, encoded,
                    {cv::IMWRITE_JPEG_QUALITY, kJpegQuality})) {
    return Unavailable("OpenCV cannot encode " + path.string());
  }
  return WriteFileAtomic(path.string(), encoded);
}

}  // namespace skein
