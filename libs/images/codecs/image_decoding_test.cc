#include "codecs/image_decoding.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "photo/exif.h"

namespace skein::image_decoding_test {

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

// Dark, with a bright upper left quarter.
cv::Mat Marked(cv::Size size) {
  cv::Mat image(size, CV_8UC3, cv::Scalar::all(20));
  image(cv::Rect({0, 0}, size / 2)).setTo(cv::Scalar::all(220));
  return image;
}

// Whether `image` is Marked, flipped left to right if `mirrored`.
void ExpectMarked(const cv::Mat& image, bool mirrored, int orientation) {
  ASSERT_EQ(image.type(), CV_8UC3);
  const auto at = [&](int x, int y) { return image.at<cv::Vec3b>(y, x)[0]; };
  const int last = image.cols - 2;
  EXPECT_NEAR(at(mirrored ? last : 1, 1), 220, 5) << orientation;
  EXPECT_NEAR(at(mirrored ? 1 : last, 1), 20, 5) << orientation;
  EXPECT_NEAR(at(1, image.rows - 2), 20, 5) << orientation;
  EXPECT_NEAR(at(last, image.rows - 2), 20, 5) << orientation;
}

TEST(DecodePhoto, LeavesPixelsAsStoredButForMirroredOnes) {
  const cv::Mat image = Marked({64, 40});
  for (uint8_t orientation = 1; orientation <= 8; ++orientation) {
    const auto photo = DecodePhoto(JpegWithOrientation(image, orientation));
    ASSERT_TRUE(photo.ok()) << photo.error();
    ASSERT_EQ(photo->size(), image.size());
    ExpectMarked(*photo, IsMirrored(orientation), orientation);
  }
}

// Little endian, one strip without compression. `values`: the samples' bytes.
Bytes TiffOf(int width, int height, int bits, bool is_float, uint16_t orientation,
             const Bytes& values) {
  Bytes tiff = {'I', 'I', 42, 0, 8, 0, 0, 0};
  const auto put = [&tiff](uint32_t value, int size) {
    for (int i = 0; i < size; ++i) tiff.push_back(static_cast<uint8_t>(value >> 8 * i));
  };
  const std::vector<std::array<uint32_t, 2>> entries = {{256, static_cast<uint32_t>(width)},
                                                        {257, static_cast<uint32_t>(height)},
                                                        {258, static_cast<uint32_t>(bits)},
                                                        {259, 1},
                                                        {262, 1},
                                                        {273, 8 + 2 + 11 * 12 + 4},
                                                        {274, orientation},
                                                        {277, 1},
                                                        {278, static_cast<uint32_t>(height)},
                                                        {279, static_cast<uint32_t>(values.size())},
                                                        {339, is_float ? 3u : 1u}};
  put(static_cast<uint32_t>(entries.size()), 2);
  for (const auto& [tag, value] : entries) {
    const bool is_long = tag == 273 || tag == 279;
    put(tag, 2);
    put(is_long ? 4 : 3, 2);
    put(1, 4);
    put(value, 4);
  }
  put(0, 4);
  tiff.insert(tiff.end(), values.begin(), values.end());
  return tiff;
}

template <typename T>
Bytes BytesOf(const cv::Mat& image) {
  const cv::Mat_<T> values = image;
  Bytes bytes(values.total() * sizeof(T));
  std::memcpy(bytes.data(), values.data, bytes.size());
  return bytes;
}

// libtiff turns them upright.
TEST(DecodePhoto, LeavesPixelsOfATiffAsStoredButForMirroredOnes) {
  for (const cv::Size size : {cv::Size(64, 40), {48, 48}}) {
    cv::Mat grey, deep;
    cv::cvtColor(Marked(size), grey, cv::COLOR_BGR2GRAY);
    grey.convertTo(deep, CV_16U, 256);
    for (uint16_t orientation = 1; orientation <= 8; ++orientation) {
      for (const Bytes& tiff :
           {TiffOf(size.width, size.height, 8, false, orientation, BytesOf<uint8_t>(grey)),
            TiffOf(size.width, size.height, 16, false, orientation, BytesOf<uint16_t>(deep))}) {
        const auto photo = DecodePhoto(tiff);
        ASSERT_TRUE(photo.ok()) << photo.error() << " " << orientation;
        ASSERT_EQ(photo->size(), size) << orientation;
        ExpectMarked(*photo, IsMirrored(orientation), orientation);
        cv::Mat pixels(size, CV_8UC3);
        const auto header = ReadPhotoHeader(tiff);
        ASSERT_TRUE(DecodePhotoInto(*header, tiff, 1, pixels.data).ok()) << orientation;
        ExpectMarked(pixels, IsMirrored(orientation), orientation);
      }
    }
  }
}

// Counts of a thermal camera.
TEST(DecodePhoto, StretchesANarrowRangeOf16Bits) {
  cv::Mat1w counts(40, 64);
  for (int x = 0; x < counts.cols; ++x) counts.col(x) = 7000 + 31 * x;
  counts(7, 9) = 65535;  // a dead pixel
  for (const Bytes& bytes : {Encode(".png", counts), Encode(".tiff", counts),
                             TiffOf(64, 40, 16, false, 1, BytesOf<uint16_t>(counts))}) {
    const auto photo = DecodePhoto(bytes);
    ASSERT_TRUE(photo.ok()) << photo.error();
    for (int x = 0; x < counts.cols; ++x) {
      EXPECT_NEAR(photo->at<cv::Vec3b>(20, x)[1], 255.0 * x / 63, 1);
    }
  }
}

TEST(DecodePhoto, StretchesFloatingPointSamples) {
  cv::Mat1f celsius(40, 64);
  for (int x = 0; x < celsius.cols; ++x) celsius.col(x) = 18.5F + 0.1F * static_cast<float>(x);
  celsius(3, 3) = std::numeric_limits<float>::quiet_NaN();
  const Bytes tiff = TiffOf(64, 40, 32, true, 1, BytesOf<float>(celsius));
  const auto photo = DecodePhoto(tiff);
  ASSERT_TRUE(photo.ok()) << photo.error();
  for (int x = 0; x < celsius.cols; ++x) {
    EXPECT_NEAR(photo->at<cv::Vec3b>(20, x)[1], 255.0 * x / 63, 1);
  }
  EXPECT_EQ(photo->at<cv::Vec3b>(3, 3)[1], 0);
}

TEST(DecodePhoto, TakesTheUpper8BitsOfAWideRange) {
  const cv::Mat deep = [] {
    cv::Mat noise(40, 64, CV_16UC3);
    cv::RNG(3).fill(noise, cv::RNG::UNIFORM, 0, 65536);
    return noise;
  }();
  const Bytes png = Encode(".png", deep);
  const auto photo = DecodePhoto(png);
  ASSERT_TRUE(photo.ok()) << photo.error();
  EXPECT_EQ(cv::norm(*photo, cv::imdecode(png, cv::IMREAD_COLOR), cv::NORM_INF), 0);
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

}  // namespace skein::image_decoding_test
