#include "features/describe_photo.h"

#include <string>

#include "core/clock.h"

namespace skein {
namespace {

std::string SizeText(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

}  // namespace

Result<PhotoDescription> DescribePhoto(PhotoDecoder* decoder, const Bytes& photo, int width_px,
                                       int height_px, int exif_orientation, SiftExtractor* sift,
                                       int threads, GlobalDescriptorModel* model) {
  const double start_s = MonotonicS();
  const auto image = decoder->Decode(photo);
  if (!image) return image.status();
  if (width_px > 0 && (image->cols != width_px || image->rows != height_px)) {
    return DataLoss("decodes to " + SizeText(image->cols, image->rows) +
                    " pixels, its header says " + SizeText(width_px, height_px));
  }
  PhotoDescription result;
  result.local = sift->Extract(*image, threads);
  result.quality = MeasureQuality(*image, result.local.keypoints);
  const double local_end_s = MonotonicS();
  result.global.model = model->id();
  result.global.values = model->Describe({*image, exif_orientation, &result.local});
  result.local_s = local_end_s - start_s;
  result.global_s = MonotonicS() - local_end_s;
  return result;
}

}  // namespace skein
