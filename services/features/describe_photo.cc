#include "features/describe_photo.h"

#include <string>

#include "core/clock.h"

namespace skein {
namespace {

std::string SizeText(int64_t width, int64_t height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

}  // namespace

Result<PhotoDescription> DescribePhoto(PhotoDecoder* decoder, const Bytes& photo, int width_px,
                                       int height_px, int exif_orientation, SiftExtractor* sift,
                                       int threads, GlobalDescriptorModel* model) {
  const double start_s = MonotonicS();
  const auto decoded = decoder->Decode(photo, sift->options().max_image_px);
  if (!decoded) return decoded.status();
  const PhotoHeader& header = decoded->header;
  if (width_px > 0 && (header.width_px != width_px || header.height_px != height_px)) {
    return DataLoss("decodes to " + SizeText(header.width_px, header.height_px) +
                    " pixels, its header says " + SizeText(width_px, height_px));
  }
  const cv::Mat& image = decoded->image;
  PhotoDescription result;
  result.local = sift->Extract(image, threads, decoded->reduction);
  result.quality = MeasureQuality(image, result.local.keypoints, decoded->reduction);
  const double local_end_s = MonotonicS();
  result.global.model = model->id();
  result.global.values = model->Describe({image, exif_orientation, &result.local});
  result.local_s = local_end_s - start_s;
  result.global_s = MonotonicS() - local_end_s;
  return result;
}

}  // namespace skein
