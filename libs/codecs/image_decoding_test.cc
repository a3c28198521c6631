#include "codecs/image_decoding.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <string>

namespace skein {
namespace {

Bytes Encode(const std::string& extension, const cv::Mat& image) {
  Bytes bytes;
  cv::imencode(extension, image, bytes);
  return bytes;
}

// A JPEG with an EXIF segment that holds nothing but the orientation.
Bytes JpegWithOrientation(const cv::Mat& image, uint8_t orientation) {
  const Bytes jpeg = Encode(".jpg", image);
  const Bytes exif = {0xFF, 0xE1, 0, 34, 'E',         'x', 'i', 'f', 0,    0,    'I', 'I',
                      42,   0,    8, 0,  0,           0,   1,   0,   0x12, 0x01, 3,   0,
                      1,    0,    0, 0,  orientation, 0,   0,   0,   0,    0,    0,   0};
  Bytes bytes(jpeg.begin(), jpeg.begin() + 2);
  bytes.insert(bytes.end(), exif.begin(), exif.end());
  bytes.insert(bytes.end(), jpeg.begin() + 2, jpeg.end());
  return bytes;
}

TEST(DecodePhoto, LeavesPixelsAsStoredWhateverTheOrientation) {
  const cv::Mat image(40, 64, CV_8UC3, cv::Scalar(10, 100, 200));
  for (uint8_t orientation = 1; orientation <= 8; ++orientation) {
    const auto photo = DecodePhoto(JpegWithOrientation(image, orientation));
    ASSERT_TRUE(photo.ok()) << photo.error();
    EXPECT_EQ(photo->size(), image.size());
  }
}

TEST(DecodePhoto, ConvertsGreyAnd16Bit) {
  const auto grey = DecodePhoto(Encode(".png", cv::Mat(9, 7, CV_8UC1, cv::Scalar(77))));
  ASSERT_TRUE(grey.ok());
  EXPECT_EQ(grey->at<cv::Vec3b>(3, 3), cv::Vec3b(77, 77, 77));
  const auto deep = DecodePhoto(Encode(".png", cv::Mat(9, 7, CV_16UC3, cv::Scalar::all(256 * 50))));
  ASSERT_TRUE(deep.ok());
  EXPECT_EQ(deep->type(), CV_8UC3);
  EXPECT_NEAR(deep->at<cv::Vec3b>(3, 3)[0], 50, 1);
}

TEST(DecodePhoto, RefusesWhatIsNoPhoto) {
  EXPECT_FALSE(DecodePhoto({}).ok());
  const std::string text = "this is not a photo";
  EXPECT_FALSE(DecodePhoto(Bytes(text.begin(), text.end())).ok());
  Bytes png = Encode(".png", cv::Mat(300, 300, CV_8UC3, cv::Scalar::all(3)));
  png.resize(40);
  EXPECT_FALSE(DecodePhoto(png).ok());
}

TEST(DecodePhoto, RefusesMorePixelsThanAllowed) {
  const Bytes png = Encode(".png", cv::Mat(100, 100, CV_8UC3, cv::Scalar::all(3)));
  EXPECT_TRUE(DecodePhoto(png, 10'000).ok());
  EXPECT_FALSE(DecodePhoto(png, 9'999).ok());
}

}  // namespace
}  // namespace skein
