#include "invite/qr_code.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/objdetect.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace skein::qr_code_test {

struct HalfBlock {
  const char* text;
  bool upper, lower;  // light
};
const HalfBlock kHalfBlocks[] = {
    {"█", true, true}, {"▀", true, false}, {"▄", false, true}, {" ", false, false}};

// What a camera sees of the terminal: a pixel a module.
cv::Mat ImageOf(const std::string& picture) {
  std::vector<std::vector<uint8_t>> rows(2);
  for (size_t at = 0; at < picture.size();) {
    if (picture[at] == '\n') {
      rows.resize(rows.size() + 2);
      ++at;
      continue;
    }
    for (const HalfBlock& block : kHalfBlocks) {
      const std::string text = block.text;
      if (picture.compare(at, text.size(), text) != 0) continue;
      rows[rows.size() - 2].push_back(block.upper ? 255 : 0);
      rows[rows.size() - 1].push_back(block.lower ? 255 : 0);
      at += text.size();
      break;
    }
  }
  rows.resize(rows.size() - 2);  // behind the last line
  cv::Mat image(static_cast<int>(rows.size()), static_cast<int>(rows[0].size()), CV_8U);
  for (int row = 0; row < image.rows; ++row) {
    for (int column = 0; column < image.cols; ++column) {
      image.at<uint8_t>(row, column) = rows[row].at(column);
    }
  }
  return image;
}

// Debian's OpenCV finds codes and does not decode them.
TEST(QrCode, IsFoundInAPictureOfTheTerminal) {
  const std::string text = "skein://10.77.0.1:7700/tcpq/0123456789abcdef/agent/alice/" +
                           std::string(240, 'x') + "-_09AZ";
  cv::Mat image;
  cv::resize(ImageOf(QrCode(text)), image, {}, 8, 8, cv::INTER_NEAREST);
  std::vector<cv::Point2f> corners;
  ASSERT_TRUE(cv::QRCodeDetector().detect(image, corners));
  ASSERT_EQ(corners.size(), 4u);
  for (const cv::Point2f& corner : corners) {
    const float x = std::min(corner.x, image.cols - corner.x) / 8;
    const float y = std::min(corner.y, image.rows - corner.y) / 8;
    EXPECT_NEAR(x, 4, 1) << "the quiet zone";
    EXPECT_NEAR(y, 4, 1.5) << "the quiet zone";
  }
}

TEST(QrCode, RefusesATextThatIsTooLong) {
  EXPECT_THROW(QrCode(std::string(3000, 'x')), std::runtime_error);
}

}  // namespace skein::qr_code_test
