#include "codecs/image_decoding.h"

#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>
#include <utility>

#include "codecs/deep_pixels.h"
#include "codecs/exif_reader.h"
#include "photo/exif.h"

namespace skein {
namespace {

// While it lives, the next 8-bit BGR image of that size is made in `pixels`. imdecode() has a
// parameter for this, but with it tells nobody that it failed.
class PixelAllocator : public cv::MatAllocator {
 public:
  PixelAllocator(cv::Size size, uint8_t* pixels) : size_(size), pixels_(pixels) {
    cv::Mat::setDefaultAllocator(this);
  }
  ~PixelAllocator() override { cv::Mat::setDefaultAllocator(before_); }

  cv::UMatData* allocate(int num_dims, const int* sizes, int type, void* data, size_t* steps,
                         cv::AccessFlag flags, cv::UMatUsageFlags usage) const override {
    const bool fits = pixels_ != nullptr && data == nullptr && steps != nullptr && num_dims == 2 &&
                      type == CV_8UC3 && sizes[0] == size_.height && sizes[1] == size_.width;
    if (fits) {
      data = std::exchange(pixels_, nullptr);
      steps[1] = 3;
      steps[0] = 3 * static_cast<size_t>(size_.width);
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
  const cv::Size size_;
  mutable uint8_t* pixels_;  // null: taken
};

cv::Size SizeOf(const PhotoHeader& header, int reduction) {
  return {static_cast<int>(ReducedSide(header.width_px, reduction)),
          static_cast<int>(ReducedSide(header.height_px, reduction))};
}

int FlagsOf(int reduction) {
  switch (reduction) {
    case 1:
      return cv::IMREAD_COLOR;
    case 2:
      return cv::IMREAD_REDUCED_COLOR_2;
    case 4:
      return cv::IMREAD_REDUCED_COLOR_4;
    case 8:
      return cv::IMREAD_REDUCED_COLOR_8;
    default:
      throw std::invalid_argument("a photo is reduced by 2, 4 or 8");
  }
}

// Of the values that 16 bits hold, a photo that uses less than half gains a bit by stretching.
constexpr double kNarrowRange = 128;  // grey levels of 8 bits

// Decodes to 8-bit BGR. OpenCV cuts deep pixels to their upper 8 bits; of a narrow range, such as a
// thermal camera's counts, nothing would be left. OpenCV decodes no 32-bit samples to 8 bits.
cv::Mat DecodeToEightBits(const cv::Mat& encoded, int flags, int bits_per_channel) {
  cv::Mat image;
  if (bits_per_channel <= 16) image = cv::imdecode(encoded, flags);
  if (bits_per_channel <= 8) return image;
  if (!image.empty()) {
    const cv::Vec2d range = ValueRange(image);
    if (range[1] - range[0] >= kNarrowRange) return image;
  }
  const cv::Mat deep = cv::imdecode(encoded, cv::IMREAD_UNCHANGED);
  if (deep.empty() || deep.depth() == CV_8U) return image;
  const cv::Vec2d range = ValueRange(deep);
  return image.empty() || range[0] < range[1] ? StretchToEightBits(deep, range) : image;
}

// libtiff turns a TIFF upright whatever it is told. `upright` -> as stored, unmirrored.
void UndoTiffOrientation(int orientation, cv::Mat* upright) {
  switch (RotationOf(orientation)) {
    case 3:
      cv::flip(*upright, *upright, -1);
      break;
    case 6:
      cv::rotate(*upright, *upright, cv::ROTATE_90_COUNTERCLOCKWISE);
      break;
    case 8:
      cv::rotate(*upright, *upright, cv::ROTATE_90_CLOCKWISE);
      break;
    default:
      break;
  }
}

// JPEG has 8 bits; libjpeg decodes no other.
int BitsPerChannel(const PhotoHeader& header, ByteView bytes) {
  if (header.format == PhotoFormat::kJpeg) return 8;
  const Result<PhotoHeader> whole = ReadPhotoHeader(bytes);
  return whole.ok() ? whole->bits_per_channel : 8;
}

}  // namespace

Result<cv::Mat> DecodePhoto(ByteView bytes, int64_t max_pixels) {
  const Result<PhotoHeader> header = ReadPhotoHeader(bytes);
  if (!header.ok()) return header.status();
  if (NumPixels(*header) > static_cast<uint64_t>(max_pixels)) {
    return ResourceExhausted("more than " + std::to_string(max_pixels) + " pixels");
  }
  return DecodePhotoOf(*header, bytes);
}

Result<cv::Mat> DecodePhotoOf(const PhotoHeader& header, ByteView bytes, int reduction) {
  const std::string name = FormatName(header.format);
  const cv::Mat encoded(1, static_cast<int>(bytes.size()), CV_8U,
                        const_cast<uint8_t*>(bytes.data()));
  cv::Mat image;
  try {
    image = DecodeToEightBits(encoded, FlagsOf(reduction) | cv::IMREAD_IGNORE_ORIENTATION,
                              BitsPerChannel(header, bytes));
  } catch (const cv::Exception& error) {
    return DataLoss(name + " cannot be decoded: " + error.err);
  }
  if (image.empty() || image.type() != CV_8UC3) return DataLoss(name + " cannot be decoded");
  const int orientation = ReadOrientation(bytes, header.format);
  if (header.format == PhotoFormat::kTiff) {
    UndoTiffOrientation(orientation, &image);
  } else if (IsMirrored(orientation)) {
    cv::flip(image, image, 1);
  }
  if (image.size() != SizeOf(header, reduction)) {
    return DataLoss(name + " decodes to another size than its header claims");
  }
  return image;
}

Status DecodePhotoInto(const PhotoHeader& header, ByteView bytes, int reduction, uint8_t* pixels) {
  const PixelAllocator allocator(SizeOf(header, reduction), pixels);
  const Result<cv::Mat> image = DecodePhotoOf(header, bytes, reduction);
  if (!image.ok()) return image.status();
  if (image->data == pixels) return Status::Ok();
  if (header.format == PhotoFormat::kJpeg) return Status::Error("pixels are not where they belong");
  // Those of a deep photo or of a turned TIFF are made in two steps.
  std::memcpy(pixels, image->data, image->total() * image->elemSize());
  return Status::Ok();
}

}  // namespace skein
