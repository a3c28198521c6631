#include "photo/image_decoding.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

namespace skein {

namespace {

constexpr int kThumbnailQuality = 80;

Result<cv::Mat> Decode(const Bytes& bytes, int mode) {
  if (bytes.empty()) return DataLoss("empty file");
  cv::Mat image;
  try {
    image = cv::imdecode(bytes, mode | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception& e) {
    return DataLoss("cannot be decoded: " + e.err);
  }
  if (image.empty()) return DataLoss("cannot be decoded as a photo");
  return image;
}

// The smallest that is at least as large as asked for.
int ReducedMode(int side_px, int max_side_px) {
  if (side_px / 8 >= max_side_px) return cv::IMREAD_REDUCED_COLOR_8;
  if (side_px / 4 >= max_side_px) return cv::IMREAD_REDUCED_COLOR_4;
  if (side_px / 2 >= max_side_px) return cv::IMREAD_REDUCED_COLOR_2;
  return cv::IMREAD_COLOR;
}

}  // namespace

Result<cv::Mat> DecodePhoto(const Bytes& bytes, int64_t max_pixels) {
  Result<cv::Mat> decoded = Decode(bytes, cv::IMREAD_COLOR);
  if (!decoded) return decoded;
  const cv::Mat& image = *decoded;
  if (static_cast<int64_t>(image.cols) * image.rows > max_pixels) {
    return ResourceExhausted("more than " + std::to_string(max_pixels) + " pixels");
  }
  return decoded;
}

cv::Mat UprightView(const cv::Mat& as_stored, int exif_orientation) {
  cv::Mat view = as_stored;
  if (exif_orientation >= 5 && exif_orientation <= 8) cv::transpose(as_stored, view);
  // OpenCV's flip codes: 1 left-right, 0 upside down, -1 both.
  static constexpr int kNoFlip = 2;
  static constexpr int kFlip[9] = {kNoFlip, kNoFlip, 1, -1, 0, kNoFlip, 1, -1, 0};
  const int flip =
      exif_orientation >= 1 && exif_orientation <= 8 ? kFlip[exif_orientation] : kNoFlip;
  if (flip == kNoFlip) return view;
  cv::Mat flipped;
  cv::flip(view, flipped, flip);
  return flipped;
}

cv::Mat ShrinkTo(const cv::Mat& image, int max_side_px) {
  const int side = std::max(image.cols, image.rows);
  if (side <= max_side_px) return image;
  const double scale = static_cast<double>(max_side_px) / side;
  const cv::Size size(std::max(1, cvRound(image.cols * scale)),
                      std::max(1, cvRound(image.rows * scale)));
  cv::Mat shrunk;
  cv::resize(image, shrunk, size, 0, 0, cv::INTER_AREA);
  return shrunk;
}

Result<Bytes> MakeThumbnail(const Bytes& photo, int width_px, int height_px, int exif_orientation,
                            int max_side_px) {
  const Result<cv::Mat> decoded =
      Decode(photo, ReducedMode(std::max(width_px, height_px), max_side_px));
  if (!decoded) return decoded.status();
  const cv::Mat thumbnail = UprightView(ShrinkTo(*decoded, max_side_px), exif_orientation);
  Bytes jpeg;
  if (!cv::imencode(".jpg", thumbnail, jpeg, {cv::IMWRITE_JPEG_QUALITY, kThumbnailQuality})) {
    return Unavailable("OpenCV could not encode a JPEG");
  }
  return jpeg;
}

}  // namespace skein
