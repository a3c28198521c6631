#include "codecs/image_decoding.h"

#include <opencv2/imgcodecs.hpp>
#include <string>
#include <utility>

namespace skein {
namespace {

// While it lives, the next 8-bit BGR image of that size is made in `pixels`. imdecode() has a
// parameter for this, but with it tells nobody that it failed.
class PixelAllocator : public cv::MatAllocator {
 public:
  PixelAllocator(const PhotoHeader& header, uint8_t* pixels)
      : width_(header.width_px), height_(header.height_px), pixels_(pixels) {
    cv::Mat::setDefaultAllocator(this);
  }
  ~PixelAllocator() override { cv::Mat::setDefaultAllocator(before_); }

  cv::UMatData* allocate(int num_dims, const int* sizes, int type, void* data, size_t* steps,
                         cv::AccessFlag flags, cv::UMatUsageFlags usage) const override {
    const bool fits = pixels_ != nullptr && data == nullptr && steps != nullptr && num_dims == 2 &&
                      type == CV_8UC3 && sizes[0] == height_ && sizes[1] == width_;
    if (fits) {
      data = std::exchange(pixels_, nullptr);
      steps[1] = 3;
      steps[0] = 3 * static_cast<size_t>(width_);
    }
    return standard_->allocate(num_dims, sizes, type, data, steps, flags, usage);
  }
  bool allocate(cv::UMatData* data, cv::AccessFlag flags, cv::UMatUsageFlags usage) const override {
    return standard_->allocate(data, flags, usage);
  }
  void deallocate(cv::UMatData* data) const override { standard_->deallocate(data); }

 private:
  cv::MatAllocator* const before_ = cv::Mat::getDefaultAllocator();
  cv::MatAllocator* const standard_ = cv::Mat::getStdAllocator();
  const int64_t width_, height_;
  mutable uint8_t* pixels_;  // null: taken
};

}  // namespace

Result<cv::Mat> DecodePhoto(ByteView bytes, int64_t max_pixels) {
  const Result<PhotoHeader> header = ReadPhotoHeader(bytes);
  if (!header.ok()) return header.status();
  if (NumPixels(*header) > static_cast<uint64_t>(max_pixels)) {
    return ResourceExhausted("more than " + std::to_string(max_pixels) + " pixels");
  }
  return DecodePhotoOf(*header, bytes);
}

Result<cv::Mat> DecodePhotoOf(const PhotoHeader& header, ByteView bytes) {
  const std::string name = FormatName(header.format);
  const cv::Mat encoded(1, static_cast<int>(bytes.size()), CV_8U,
                        const_cast<uint8_t*>(bytes.data()));
  cv::Mat image;
  try {
    image = cv::imdecode(encoded, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception& error) {
    return DataLoss(name + " cannot be decoded: " + error.err);
  }
  if (image.empty() || image.type() != CV_8UC3) return DataLoss(name + " cannot be decoded");
  if (image.cols != header.width_px || image.rows != header.height_px) {
    return DataLoss(name + " decodes to another size than its header claims");
  }
  return image;
}

Status DecodePhotoInto(const PhotoHeader& header, ByteView bytes, uint8_t* pixels) {
  const PixelAllocator allocator(header, pixels);
  const Result<cv::Mat> image = DecodePhotoOf(header, bytes);
  if (!image.ok()) return image.status();
  return image->data == pixels ? Status::Ok() : Status::Error("pixels are not where they belong");
}

}  // namespace skein
