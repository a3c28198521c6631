#include "codecs/check_photo.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "codecs/exif_reader.h"
#include "testing/test_photos.h"

namespace skein::check_photo_test {

std::string Reason(const Bytes& bytes) { return CheckPhoto(bytes, PhotoLimits()).error(); }

Bytes Cut(const Bytes& bytes, double fraction) {
  return Bytes(bytes.begin(), bytes.begin() + static_cast<ptrdiff_t>(bytes.size() * fraction));
}

TEST(PhotoCheck, TakesJpegPngAndTiff) {
  for (const std::string extension : {".jpg", ".png", ".tiff"}) {
    const auto photo = CheckPhoto(Encode(Noise(96, 80), extension), PhotoLimits());
    ASSERT_TRUE(photo.ok()) << extension << ": " << photo.error();
    EXPECT_EQ(photo->header.width_px, 96);
    EXPECT_EQ(photo->header.height_px, 80);
    EXPECT_EQ(photo->header.channels, 3);
  }
}

TEST(PhotoCheck, TakesGreyAnd16Bit) {
  EXPECT_EQ(Reason(Encode(Noise(96, 80, CV_8UC1), ".jpg")), "");
  EXPECT_EQ(Reason(Encode(Noise(96, 80, CV_8UC1), ".png")), "");
  EXPECT_EQ(Reason(Encode(Noise(96, 80, CV_16UC1), ".png")), "");
  EXPECT_EQ(Reason(Encode(Noise(96, 80, CV_16UC3), ".png")), "");
  EXPECT_EQ(Reason(Encode(Noise(96, 80, CV_16UC3), ".tiff")), "");
}

TEST(PhotoCheck, TakesProgressiveJpeg) {
  Bytes bytes;
  cv::imencode(".jpg", Noise(96, 80), bytes, {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  EXPECT_EQ(CountJpegScans(bytes, 1000), 10);
  EXPECT_EQ(Reason(bytes), "");
  EXPECT_NE(Reason(Cut(bytes, 0.7)), "");
}

TEST(PhotoCheck, RefusesWhatIsNoPhoto) {
  EXPECT_EQ(Reason({}), "empty file");
  const std::string text = "this is a text file called .jpg\n";
  EXPECT_EQ(Reason(Bytes(text.begin(), text.end())), "not a JPEG, PNG or TIFF photo");
}

TEST(PhotoCheck, RefusesTruncatedPhotosOfEveryFormat) {
  for (const std::string extension : {".jpg", ".png", ".tiff"}) {
    const Bytes bytes = Encode(Noise(96, 80), extension);
    for (const double fraction : {0.001, 0.01, 0.1, 0.5, 0.9, 0.99}) {
      EXPECT_NE(Reason(Cut(bytes, fraction)), "") << extension << " cut to " << fraction;
    }
  }
}

TEST(PhotoCheck, RefusesAJpegWhoseLastBytesAreMissing) {
  Bytes bytes = SmallJpeg();
  bytes.resize(bytes.size() - 40);
  EXPECT_NE(Reason(bytes).find("damaged JPEG"), std::string::npos);
}

TEST(PhotoCheck, RefusesDamageInTheMiddle) {
  Bytes jpeg = SmallJpeg();
  for (size_t i = 0; i < 200; ++i) jpeg[jpeg.size() / 2 + i] = 0xff;
  EXPECT_NE(Reason(jpeg), "");
  Bytes png = Encode(Noise(96, 80), ".png");
  png[png.size() / 2] ^= 1;
  EXPECT_EQ(Reason(png), "damaged PNG: wrong checksum");
}

TEST(PhotoCheck, SurvivesEverySingleDamagedHeaderByte) {
  const Bytes jpeg = SmallJpeg();
  for (size_t at = 0; at < 700 && at < jpeg.size(); ++at) {
    Bytes damaged = jpeg;
    damaged[at] ^= 0xff;
    Reason(damaged);  // refused or not, it returns
  }
}

TEST(PhotoCheck, RefusesABombWithoutDecodingIt) {
  EXPECT_NE(Reason(WithClaimedSize(SmallJpeg(), 60000, 60000)).find("header claims 60000 x 60000"),
            std::string::npos);
  Bytes png = Encode(Noise(96, 80), ".png");
  png[16] = png[20] = 0xff;
  EXPECT_NE(Reason(png).find("header claims"), std::string::npos);
}

// libjpeg passes over ff 00 byte by byte; by its length it is a segment, which hides the photo.
TEST(PhotoCheck, RefusesAJpegThatTellsTwoSizes) {
  const Bytes photo = SmallJpeg();
  const size_t length = photo.size();
  Bytes two = {
      0xff, 0xd8, 0xff, 0x00, static_cast<uint8_t>(length >> 8), static_cast<uint8_t>(length)};
  two.insert(two.end(), photo.begin() + 2, photo.end());
  const Bytes other_frame = {0xff, 0xc0, 0, 11, 8, 0, 64, 0, 64, 1, 1, 0x11, 0};
  two.insert(two.end(), other_frame.begin(), other_frame.end());
  EXPECT_EQ(Reason(photo), "");
  EXPECT_EQ(Reason(two), "damaged JPEG: it tells two sizes of the image");
}

TEST(PhotoCheck, RefusesTinyPhotos) {
  EXPECT_NE(Reason(Encode(Noise(1, 1), ".png")).find("1 x 1 pixels"), std::string::npos);
  EXPECT_NE(Reason(Encode(Noise(1, 1), ".jpg")), "");
  EXPECT_NE(Reason(Encode(Noise(640, 63), ".jpg")), "");
  EXPECT_NE(Reason(WithClaimedSize(SmallJpeg(), 0, 0)), "");
}

TEST(PhotoCheck, RefusesFilesAboveTheLimit) {
  PhotoLimits limits;
  limits.max_bytes = 100;
  EXPECT_NE(CheckPhoto(SmallJpeg(), limits).error().find("more than 100"), std::string::npos);
}

TEST(Exif, ReadsOrientationBodyAndTime) {
  ExifBuilder builder;
  builder.Ascii(0, 0x010f, "Panasonic");
  builder.Ascii(0, 0x0110, "DMC-TZ3 ");
  builder.Short(0, 0x0112, 6);
  builder.Ascii(1, 0x9003, "2009:02:14 00:31:30");
  builder.Ascii(1, 0x9011, "+01:00");
  builder.Ascii(1, 0x9291, "25");
  const auto photo = CheckPhoto(builder.Into(SmallJpeg()), PhotoLimits());
  ASSERT_TRUE(photo.ok()) << photo.error();
  EXPECT_EQ(photo->exif.orientation, 6);
  EXPECT_EQ(photo->header.width_px, 96);  // as stored
  EXPECT_EQ(photo->exif.make, "Panasonic");
  EXPECT_EQ(photo->exif.model, "DMC-TZ3");
  EXPECT_EQ(photo->exif.capture_utime_us, 1234567890250000);
}

TEST(Exif, ReadsGps) {
  ExifBuilder builder;
  builder.Ascii(2, 1, "S");
  builder.Rationals(2, 2, {{33, 1}, {30, 1}, {36, 1}});
  builder.Ascii(2, 3, "E");
  builder.Rationals(2, 4, {{151, 1}, {15, 1}, {0, 1}});
  builder.Byte(2, 5, 1);
  builder.Rationals(2, 6, {{125, 10}});
  const auto photo = CheckPhoto(builder.Into(SmallJpeg()), PhotoLimits());
  ASSERT_TRUE(photo.ok()) << photo.error();
  ASSERT_TRUE(photo->exif.gps);
  EXPECT_NEAR(photo->exif.gps->latitude_deg, -33.51, 1e-9);
  EXPECT_NEAR(photo->exif.gps->longitude_deg, 151.25, 1e-9);
  EXPECT_NEAR(photo->exif.gps->altitude_m.value(), -12.5, 1e-9);
  EXPECT_FALSE(photo->exif.gps->relative_altitude_m);
}

TEST(Exif, AnAltitudeThatIsNotThereIsNotZero) {
  ExifBuilder builder;
  builder.Ascii(2, 1, "N");
  builder.Rationals(2, 2, {{48, 1}, {0, 1}, {0, 1}});
  builder.Ascii(2, 3, "E");
  builder.Rationals(2, 4, {{11, 1}, {0, 1}, {0, 1}});
  ExifBuilder undefined = builder;
  undefined.Byte(2, 5, 0);
  undefined.Rationals(2, 6, {{0, 0}});
  for (const ExifBuilder& exif : {builder, undefined}) {
    const auto photo = CheckPhoto(exif.Into(SmallJpeg()), PhotoLimits());
    ASSERT_TRUE(photo.ok() && photo->exif.gps);
    EXPECT_FALSE(photo->exif.gps->altitude_m);
  }
  ExifBuilder sea_level = builder;
  sea_level.Rationals(2, 6, {{0, 1}});
  EXPECT_EQ(CheckPhoto(sea_level.Into(SmallJpeg()), PhotoLimits())->exif.gps->altitude_m, 0.0);
}

TEST(Exif, TakesTheFocalLengthFromWhatIsThere) {
  const PhotoHeader header{PhotoFormat::kJpeg, 1600, 1200, 3, 8};
  ExifBuilder film;
  film.Short(1, 0xa405, 28);
  EXPECT_NEAR(*ReadExif(film.Into(SmallJpeg()), header).focal_px, 28 * 2000 / 43.2666, 0.01);

  ExifBuilder plane;  // 3200 px at 400 px a mm: 8 mm wide
  plane.Rationals(1, 0x920a, {{10, 1}});
  plane.Rationals(1, 0xa20e, {{4000, 1}});
  plane.Short(1, 0xa210, 3);
  plane.Short(1, 0xa002, 3200);
  EXPECT_NEAR(*ReadExif(plane.Into(SmallJpeg()), header).focal_px, 10.0 / 8 * 1600, 0.01);

  ExifBuilder body;
  body.Rationals(1, 0x920a, {{50, 1}});
  body.Ascii(0, 0x010f, "Canon");
  body.Ascii(0, 0x0110, "Canon EOS 5D Mark II");
  const auto focal = ReadExif(body.Into(SmallJpeg()), header).focal_px;
  ASSERT_TRUE(focal);
  EXPECT_NEAR(*focal, 50.0 / 36 * 1600, 20);
}

// Panasonic's Lumix DMC-S2 is in COLMAP's database, 6.08 mm wide: 28 mm are about 4.6 mm without
// digital zoom.
TEST(Exif, CountsDigitalZoomOnce) {
  const PhotoHeader header{PhotoFormat::kJpeg, 1600, 1200, 3, 8};
  const auto read = [&](int focal35_mm, bool is_known_body) {
    ExifBuilder builder;
    if (is_known_body) builder.Ascii(0, 0x010f, "Panasonic");
    if (is_known_body) builder.Ascii(0, 0x0110, "Lumix DMC-S2");
    builder.Rationals(1, 0x920a, {{46, 10}});
    builder.Rationals(1, 0xa404, {{2, 1}});
    if (focal35_mm > 0) builder.Short(1, 0xa405, focal35_mm);
    return ReadExif(builder.Into(SmallJpeg()), header);
  };
  const double expected_px = 56 * 2000 / 43.2666;
  for (const int focal35_mm : {28, 56}) {
    const Exif exif = read(focal35_mm, true);
    EXPECT_NEAR(*exif.focal_px, expected_px, 0.01) << focal35_mm;
    EXPECT_FALSE(exif.focal_is_guess);
    EXPECT_EQ(exif.digital_zoom, 2);
  }
  EXPECT_NEAR(*read(0, true).focal_px, expected_px, 0.1 * expected_px);
  EXPECT_TRUE(read(56, false).focal_is_guess);
  EXPECT_NEAR(*read(56, false).focal_px, expected_px, 0.01);
}

// 4.6 mm of the same body again, beside a value that is a hundred times what it should be.
TEST(Exif, OfFocalLengthsThatContradictEachOtherTheUsualOneCounts) {
  const auto read = [](uint32_t focal_tenths_mm, int focal35_mm) {
    ExifBuilder builder;
    builder.Ascii(0, 0x010f, "Panasonic");
    builder.Ascii(0, 0x0110, "Lumix DMC-S2");
    builder.Rationals(1, 0x920a, {{focal_tenths_mm, 10}});
    builder.Short(1, 0xa405, focal35_mm);
    return ReadExif(builder.Into(SmallJpeg()), {PhotoFormat::kJpeg, 1600, 1200, 3, 8});
  };
  const double expected_px = 28 * 2000 / 43.2666;
  for (const Exif& exif : {read(46, 28), read(46, 2800), read(4600, 28)}) {
    EXPECT_NEAR(*exif.focal_px, expected_px, 0.1 * expected_px);
  }
  EXPECT_FALSE(read(46, 28).focal_is_guess);
  EXPECT_TRUE(read(46, 2800).focal_is_guess);
  EXPECT_FALSE(read(4600, 28).focal_is_guess);
}

TEST(Exif, KnowsACropByItsShape) {
  const auto read = [](uint32_t width_px, uint32_t height_px) {
    ExifBuilder builder;
    builder.Short(1, 0xa405, 28);
    builder.Short(1, 0xa002, 3200);
    builder.Short(1, 0xa003, 2400);
    return ReadExif(builder.Into(SmallJpeg()), {PhotoFormat::kJpeg, width_px, height_px, 3, 8});
  };
  const double whole_px = 28 * 4000 / 43.2666;
  EXPECT_NEAR(*read(1600, 1200).focal_px, whole_px / 2, 0.01);
  EXPECT_NEAR(*read(1201, 1600).focal_px, whole_px / 2, 1);  // turned, rounded
  EXPECT_NEAR(*read(3200, 1800).focal_px, whole_px, 0.01);
  EXPECT_FALSE(read(3200, 1800).focal_is_guess || read(1600, 1200).focal_is_guess);
  EXPECT_NEAR(*read(1600, 900).focal_px, whole_px / 2, 0.01);
  EXPECT_TRUE(read(1600, 900).focal_is_guess);
}

TEST(Exif, IgnoresAbsurdValues) {
  ExifBuilder builder;
  builder.Short(0, 0x0112, 77);
  builder.Short(1, 0xa405, 65535);
  builder.Rationals(1, 0x920a, {{10, 0}});
  builder.Rationals(2, 2, {{400, 1}, {0, 1}, {0, 1}});
  builder.Rationals(2, 4, {{10, 0}, {0, 0}, {0, 0}});
  builder.Ascii(1, 0x9003, "0000:00:00 00:00:00");
  const Exif exif = ReadExif(builder.Into(SmallJpeg()), {PhotoFormat::kJpeg, 96, 80, 3, 8});
  EXPECT_EQ(exif.orientation, 1);
  EXPECT_FALSE(exif.focal_px);
  EXPECT_FALSE(exif.gps);
  EXPECT_EQ(exif.capture_utime_us, 0);
}

TEST(Exif, IsEmptyWithoutABlock) {
  const Exif exif = ReadExif(SmallJpeg(), {PhotoFormat::kJpeg, 96, 80, 3, 8});
  EXPECT_EQ(exif.orientation, 1);
  EXPECT_FALSE(exif.focal_px);
  EXPECT_EQ(exif.make, "");
}

}  // namespace skein::check_photo_test
