#include "photo/image_view.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "photo/exif.h"

namespace skein {

cv::Mat UprightView(const cv::Mat& decoded, int exif_orientation) {
  const int rotation = RotationOf(exif_orientation);
  if (rotation == 1) return decoded;
  cv::Mat view;
  cv::rotate(decoded, view,
             rotation == 3   ? cv::ROTATE_180
             : rotation == 6 ? cv::ROTATE_90_CLOCKWISE
                             : cv::ROTATE_90_COUNTERCLOCKWISE);
  return view;
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
