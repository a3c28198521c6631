#include "photo/image_view.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace skein {

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

}  // namespace skein
