#include "photo/photo_check.h"

#include <algorithm>
#include <cmath>

#include "photo/heif.h"

namespace skein {
namespace {

std::string SizeText(const PhotoHeader& header) {
  return std::to_string(header.width_px) + " x " + std::to_string(header.height_px);
}

Status CheckSize(const PhotoHeader& header, const PhotoLimits& limits) {
  const int64_t shorter = std::min(header.width_px, header.height_px);
  if (shorter < limits.min_side_px) {
    return InvalidArgument(SizeText(header) + " pixels: a side is shorter than " +
                           std::to_string(limits.min_side_px));
  }
  if (NumPixels(header) > static_cast<uint64_t>(limits.max_pixels)) {
    return ResourceExhausted("header claims " + SizeText(header) + " pixels, more than " +
                             std::to_string(limits.max_pixels / 1'000'000) + " megapixels");
  }
  return Status::Ok();
}

}  // namespace

Status PhotoLimits::Check() const {
  if (max_bytes < 1 || max_bytes > kMaxPhotoBytes) {
    return InvalidArgument("the largest file must have 1 to " + std::to_string(kMaxPhotoBytes) +
                           " bytes");
  }
  if (max_pixels < 1 || max_pixels > kMaxPhotoPixels) {
    return InvalidArgument("the largest photo must have 1 to " + std::to_string(kMaxPhotoPixels) +
                           " pixels");
  }
  if (min_side_px < 1) return InvalidArgument("the shortest side must have at least 1 pixel");
  return Status::Ok();
}

Result<PhotoHeader> CheckHeader(ByteView bytes, const PhotoLimits& limits) {
  if (static_cast<int64_t>(bytes.size()) > limits.max_bytes) {
    return ResourceExhausted("file has " + std::to_string(bytes.size()) + " bytes, more than " +
                             std::to_string(limits.max_bytes));
  }
  Result<PhotoHeader> header = ReadPhotoHeader(bytes);
  if (!header.ok()) return header;
  if (Status status = CheckSize(*header, limits); !status.ok()) return status;
  if (header->format == PhotoFormat::kJpeg &&
      CountJpegScans(bytes, kMaxJpegScans + 1) > kMaxJpegScans) {
    return ResourceExhausted("the JPEG has more than " + std::to_string(kMaxJpegScans) + " scans");
  }
  if (header->format == PhotoFormat::kPng &&
      CountPngTexts(bytes, kMaxPngTexts + 1) > kMaxPngTexts) {
    return ResourceExhausted("the PNG has more than " + std::to_string(kMaxPngTexts) +
                             " compressed texts");
  }
  return header;
}

PhotoFault FaultOf(StatusCode error, ByteView bytes) {
  switch (error) {
    case StatusCode::kDataLoss:
      return PhotoFault::kUnreadable;
    case StatusCode::kResourceExhausted:
      return PhotoFault::kTooLarge;
    case StatusCode::kInvalidArgument:
      if (HeifName(bytes) != nullptr) return PhotoFault::kPhoneFormat;
      return ReadPhotoHeader(bytes).ok() ? PhotoFault::kTooSmall : PhotoFault::kUnreadable;
    default:
      return PhotoFault::kOther;
  }
}

FocalPrior ChooseFocal(const CheckedPhoto& photo, double offered_focal_px) {
  const double longer =
      static_cast<double>(std::max(photo.header.width_px, photo.header.height_px));
  if (photo.exif.focal_px) return {*photo.exif.focal_px, !photo.exif.focal_is_guess};
  const bool sane = offered_focal_px > 0.1 * longer && offered_focal_px < 100 * longer;
  return {sane ? offered_focal_px : 1.2 * longer, false};
}

std::string CameraKey(const std::string& agent, const CheckedPhoto& photo,
                      const FocalPrior& focal) {
  const double zoom = photo.exif.digital_zoom;
  return agent + "|" + photo.exif.make + "|" + photo.exif.model + "|" + SizeText(photo.header) +
         "|" + std::to_string(std::llround(focal.focal_px)) +
         (zoom > 1 ? "|zoom " + std::to_string(std::llround(100 * zoom)) : "");
}

}  // namespace skein
