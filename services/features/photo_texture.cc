#include "features/photo_texture.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "photo/image_view.h"

namespace skein {
namespace {

constexpr int kTextureSidePx = 1600;
constexpr int kWindowPx = 7, kWindowArea = kWindowPx * kWindowPx;
constexpr int kMinDeviation = 2;   // grey levels
constexpr int kWindowsAcross = 4;  // of a field, both ways

cv::Mat1b GreyOf(const cv::Mat& image) {
  cv::Mat grey = image;
  if (image.channels() == 3) cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  return ShrinkTo(grey, kTextureSidePx);
}

bool HasTexture(const cv::Mat1b& grey, int left, int top) {
  int sum = 0, squares = 0;
  for (int y = top; y < top + kWindowPx; ++y) {
    const uint8_t* row = grey[y] + left;
    for (int x = 0; x < kWindowPx; ++x) {
      sum += row[x];
      squares += row[x] * row[x];
    }
  }
  // kWindowArea^2 times the variance
  constexpr int kLeast = kMinDeviation * kMinDeviation * kWindowArea * kWindowArea;
  return kWindowArea * squares - sum * sum >= kLeast;
}

// Of the i-th of `count` windows that are spread evenly along a side: its first pixel.
int PlaceOf(int i, int count, int side_px) {
  const int middle = static_cast<int>((i + 0.5) * side_px / count);
  return std::clamp(middle - kWindowPx / 2, 0, side_px - kWindowPx);
}

}  // namespace

TextureFields FindTexture(const cv::Mat& bgr_or_grey) {
  constexpr int kHalf = kWindowsAcross * kWindowsAcross / 2;
  TextureFields fields;
  const cv::Mat1b grey = GreyOf(bgr_or_grey);
  if (grey.cols < kWindowPx || grey.rows < kWindowPx) return fields;
  for (int row = 0; row < TextureFields::kRows; ++row) {
    for (int column = 0; column < TextureFields::kColumns; ++column) {
      int count = 0;
      for (int i = 0; i < kWindowsAcross * kWindowsAcross; ++i) {
        const int x = column * kWindowsAcross + i % kWindowsAcross;
        const int y = row * kWindowsAcross + i / kWindowsAcross;
        count += HasTexture(grey, PlaceOf(x, TextureFields::kColumns * kWindowsAcross, grey.cols),
                            PlaceOf(y, TextureFields::kRows * kWindowsAcross, grey.rows));
      }
      if (count >= kHalf) fields.Set(column, row);
    }
  }
  return fields;
}

}  // namespace skein
