#include "codecs/photo_encoding.h"

#include <gtest/gtest.h>

#include "codecs/exif_reader.h"

namespace skein::photo_encoding_test {

Exif WriteAndRead(const ExifInfo* info) {
  const Bytes jpeg = EncodePhoto(cv::Mat3b(48, 64, cv::Vec3b(9, 9, 9)), info, 90);
  const Result<PhotoHeader> header = ReadPhotoHeader(jpeg);
  EXPECT_TRUE(header.ok()) << header.error();
  return ReadExif(jpeg, *header);
}

TEST(EncodePhoto, ExifIsReadBack) {
  ExifInfo info;
  info.make = "Skein";
  info.model = "Simulated camera 12";
  info.capture_utime_us = 1777629600LL * 1000000 + 250000;
  info.focal_mm = 5;
  info.focal_35mm = 31;
  info.width = 64;
  info.height = 48;
  info.gps = GpsPosition{-48.25, 11.5, 520, {}};
  const Exif exif = WriteAndRead(&info);
  EXPECT_EQ(exif.make, info.make);
  EXPECT_EQ(exif.model, info.model);
  EXPECT_EQ(exif.capture_utime_us, info.capture_utime_us);
  ASSERT_TRUE(exif.focal_px);
  EXPECT_NEAR(*exif.focal_px, 31 * 80 / 43.27, 0.1);
  ASSERT_TRUE(exif.gps);
  EXPECT_NEAR(exif.gps->latitude_deg, -48.25, 1e-9);
  EXPECT_NEAR(exif.gps->longitude_deg, 11.5, 1e-9);
  EXPECT_NEAR(exif.gps->altitude_m.value(), 520, 1e-3);
}

TEST(EncodePhoto, WhatIsNotKnownIsLeftOut) {
  const ExifInfo nothing;
  for (const ExifInfo* info : {&nothing, static_cast<const ExifInfo*>(nullptr)}) {
    const Exif exif = WriteAndRead(info);
    EXPECT_EQ(exif.capture_utime_us, 0);
    EXPECT_FALSE(exif.focal_px);
    EXPECT_FALSE(exif.gps);
  }
}

}  // namespace skein::photo_encoding_test
