#include "photo/image_decoding.h"

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

TEST(UprightView, BringsTheMarkedCornerToTheUpperLeft) {
  // Where the upright view's upper left pixel is stored, by orientation.
  const cv::Size upright(3, 2);
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const bool sideways = orientation >= 5;
    cv::Mat stored(sideways ? cv::Size(2, 3) : upright, CV_8UC3, cv::Scalar::all(0));
    const bool at_right =
        orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8;
    const bool at_bottom =
        orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
    stored.at<cv::Vec3b>(at_bottom ? stored.rows - 1 : 0, at_right ? stored.cols - 1 : 0) =
        cv::Vec3b::all(255);
    const cv::Mat view = UprightView(stored, orientation);
    EXPECT_EQ(view.size(), upright) << orientation;
    EXPECT_EQ(view.at<cv::Vec3b>(0, 0)[0], 255) << orientation;
  }
}

TEST(ShrinkTo, NeverEnlarges) {
  EXPECT_EQ(ShrinkTo(cv::Mat(30, 40, CV_8UC3), 1600).size(), cv::Size(40, 30));
  EXPECT_EQ(ShrinkTo(cv::Mat(3000, 4000, CV_8UC3), 1600).size(), cv::Size(1600, 1200));
}

// Of a picture whose left half is dark; upright, the dark half is where the orientation says.
TEST(MakeThumbnail, IsUprightAndSmall) {
  cv::Mat image(600, 1000, CV_8UC3, cv::Scalar(200, 200, 200));
  image.colRange(0, 500).setTo(cv::Scalar(20, 20, 20));
  const Bytes photo = JpegWithOrientation(image, 6);
  const Result<Bytes> jpeg = MakeThumbnail(photo, 1000, 600, 6, 100);
  ASSERT_TRUE(jpeg.ok()) << jpeg.error();
  const cv::Mat thumbnail = cv::imdecode(*jpeg, cv::IMREAD_COLOR);
  ASSERT_EQ(thumbnail.size(), cv::Size(60, 100)) << "turned by 90 degrees, clockwise";
  EXPECT_LT(thumbnail.at<cv::Vec3b>(10, 30)[0], 60);
  EXPECT_GT(thumbnail.at<cv::Vec3b>(90, 30)[0], 160);
}

TEST(MakeThumbnail, NeverEnlarges) {
  const Result<Bytes> jpeg =
      MakeThumbnail(Encode(".png", cv::Mat(9, 7, CV_8UC1, cv::Scalar(77))), 7, 9, 1, 320);
  ASSERT_TRUE(jpeg.ok()) << jpeg.error();
  EXPECT_EQ(cv::imdecode(*jpeg, cv::IMREAD_COLOR).size(), cv::Size(7, 9));
  EXPECT_FALSE(MakeThumbnail({1, 2, 3}, 100, 100, 1, 320).ok());
}

}  // namespace
}  // namespace skein
