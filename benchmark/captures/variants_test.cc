#include "benchmark/captures/variants.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "codecs/exif_reader.h"
#include "codecs/photo_encoding.h"
#include "photo/exif.h"
#include "photo/image_view.h"
#include "testing/test_photos.h"

namespace skein::variants_test {

constexpr double kFocalPx = 400;
const cv::Size kSize(320, 240);

// Smooth, so that interpolation changes little.
cv::Mat3b SmoothPhoto() {
  cv::Mat3b photo = Noise(kSize.width, kSize.height);
  cv::GaussianBlur(photo, photo, {}, 6);
  cv::normalize(photo, photo, 10, 245, cv::NORM_MINMAX);
  return photo;
}

double MeanDifference(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_L1) / static_cast<double>(a.total() * a.channels());
}

double Contrast(const cv::Mat3b& photo) {
  cv::Scalar mean, deviation;
  cv::meanStdDev(photo, mean, deviation);
  return deviation[1];
}

// Where the camera sees a ray of the unturned camera's frame; OpenCV's pixels.
cv::Point2d Seen(cv::Vec3d ray, double yaw_rad, cv::Size size) {
  const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
  const cv::Vec3d turned(c * ray[0] - s * ray[2], ray[1], s * ray[0] + c * ray[2]);
  return {kFocalPx * turned[0] / turned[2] + (size.width - 1) / 2.0,
          kFocalPx * turned[1] / turned[2] + (size.height - 1) / 2.0};
}

// The middle of the white dot.
cv::Point2d DotIn(const cv::Mat3b& photo) {
  cv::Mat grey;
  cv::cvtColor(photo, grey, cv::COLOR_BGR2GRAY);
  const cv::Moments dot = cv::moments(grey);
  return {dot.m10 / dot.m00, dot.m01 / dot.m00};
}

TEST(Half, HalvesBothSides) { EXPECT_EQ(Half(cv::Mat3b(101, 200)).size(), cv::Size(100, 50)); }

TEST(Exposed, ChangesLightByItsFactor) {
  const cv::Mat3b grey(8, 8, cv::Vec3b(100, 100, 100));
  const auto light = [](const cv::Mat3b& photo) { return std::pow(photo(4, 4)[1], 2.2); };
  EXPECT_NEAR(light(Exposed(grey, 2)) / light(grey), 2, 0.05);
  EXPECT_NEAR(light(Exposed(grey, 0.5)) / light(grey), 0.5, 0.02);
  EXPECT_EQ(Exposed(cv::Mat3b(8, 8, cv::Vec3b(250, 250, 250)), 2)(4, 4)[1], 255);
}

TEST(Hazy, LeavesItsShareOfTheContrast) {
  const cv::Mat3b photo = SmoothPhoto();
  EXPECT_NEAR(Contrast(Hazy(photo, 0.2, 1)) / Contrast(photo), 0.2, 0.02);
}

TEST(Hazy, GivesEachPhotoItsOwnNoise) {
  const cv::Mat3b photo = SmoothPhoto();
  EXPECT_GT(MeanDifference(Hazy(photo, 0.2, 1), Hazy(photo, 0.2, 2)), 0.5);
}

TEST(Zoomed, EnlargesAboutTheMiddle) {
  cv::Mat3b photo(kSize, cv::Vec3b(0, 0, 0));
  const cv::Point2d middle((kSize.width - 1) / 2.0, (kSize.height - 1) / 2.0), offset(40, -20);
  cv::circle(photo, middle + offset, 5, {255, 255, 255}, -1);
  const cv::Point2d before = DotIn(photo) - middle;
  const cv::Point2d after = DotIn(Zoomed(photo, 1.5)) - middle;
  EXPECT_NEAR(after.x, 1.5 * before.x, 0.1);
  EXPECT_NEAR(after.y, 1.5 * before.y, 0.1);
}

TEST(Zoomed, LeavesThePhotoByOne) {
  const cv::Mat3b photo = SmoothPhoto();
  EXPECT_EQ(MeanDifference(Zoomed(photo, 1), photo), 0);
}

TEST(Overlaid, ChangesTheSamePixelsOfEachPhoto) {
  cv::Mat changed[2];
  for (const int i : {0, 1}) {
    const cv::Mat3b grey(kSize.height * 4, kSize.width * 4, cv::Vec3b::all(50 + 50 * i));
    cv::Mat1b channel;
    cv::extractChannel(Overlaid(grey), channel, 1);
    changed[i] = channel != 50 + 50 * i;
  }
  EXPECT_EQ(cv::norm(changed[0], changed[1], cv::NORM_INF), 0);
  const double share = cv::countNonZero(changed[0]) / static_cast<double>(changed[0].total());
  EXPECT_GT(share, 0.005);
  EXPECT_LT(share, 0.05);
}

TEST(Turned, MovesARayAsTheTurnedCameraSeesIt) {
  const cv::Vec3d ray(0.12, -0.05, 1);
  cv::Mat3b photo(kSize, cv::Vec3b(0, 0, 0));
  cv::circle(photo, Seen(ray, 0, kSize), 4, {255, 255, 255}, -1);
  // To what the circle is, in whole pixels.
  const cv::Point2d rounding = DotIn(photo) - Seen(ray, 0, kSize);
  const cv::Size view(kSize.width / 2, kSize.height / 2);
  const cv::Point2d seen = DotIn(Turned(photo, kFocalPx, {0.1, 0, 0}, view));
  EXPECT_NEAR(seen.x - rounding.x, Seen(ray, 0.1, view).x, 0.3);
  EXPECT_NEAR(seen.y - rounding.y, Seen(ray, 0.1, view).y, 0.3);
}

TEST(Turned, TurnsRightDownAndClockwise) {
  cv::Mat3b photo(kSize, cv::Vec3b(0, 0, 0));
  const cv::Point2d dot(220, 119.5);
  cv::circle(photo, dot, 4, {255, 255, 255}, -1);
  EXPECT_LT(DotIn(Turned(photo, kFocalPx, {0.1, 0, 0}, kSize)).x, dot.x - 30);
  EXPECT_LT(DotIn(Turned(photo, kFocalPx, {0, 0.1, 0}, kSize)).y, dot.y - 30);
  EXPECT_LT(DotIn(Turned(photo, kFocalPx, {0, 0, 0.1}, kSize)).y, dot.y - 3);
}

TEST(Sweep, ShowsNothingFromOutsideThePhoto) {
  // A border that is repeated would show a value that no pixel inside has.
  cv::Mat3b photo(kSize, cv::Vec3b(0, 0, 0));
  cv::rectangle(photo, cv::Rect({}, kSize), {255, 255, 255}, 1);
  const std::vector<Turn> turns = Sweep(kSize, kFocalPx, 12);
  ASSERT_EQ(turns.size(), 12u);
  for (const Turn& turn : turns) {
    const cv::Mat3b view = Turned(photo, kFocalPx, turn, {kSize.width / 2, kSize.height / 2});
    // At most the border's own line along two sides.
    EXPECT_LT(cv::mean(view)[0],
              255.0 * 2 * (view.cols + view.rows) / static_cast<double>(view.total()));
  }
  EXPECT_GT(turns[5].yaw_rad - turns[0].yaw_rad, 0.2);
}

TEST(BurstShot, ShowsTheSameFromAlmostTheSameDirection) {
  cv::Mat3b photo(kSize, cv::Vec3b(100, 100, 100));
  cv::circle(photo, {200, 80}, 8, {250, 250, 250}, -1);
  const auto bright = [](const cv::Mat3b& shot) {
    cv::Mat3b dots;
    cv::threshold(shot, dots, 180, 255, cv::THRESH_BINARY);
    return DotIn(dots);
  };
  // Of three turns of 0.1 to 0.3 degrees the roll moves the dot least.
  const double degree_px = kFocalPx * CV_PI / 180;
  for (const uint64_t seed : {1, 2, 3}) {
    const cv::Point2d moved = bright(BurstShot(photo, kFocalPx, seed)) - bright(photo);
    EXPECT_GT(cv::norm(moved), 0.1 * degree_px) << seed;
    EXPECT_LT(cv::norm(moved), 0.6 * degree_px) << seed;
  }
}

TEST(BurstShot, GivesEachShotItsOwnNoise) {
  const cv::Mat3b photo = SmoothPhoto();
  EXPECT_GT(MeanDifference(BurstShot(photo, kFocalPx, 1), BurstShot(photo, kFocalPx, 2)), 0.5);
}

TEST(StoredAs, IsUndoneByTheUprightView) {
  const cv::Mat3b photo = Noise(6, 4);
  for (int orientation = 1; orientation <= 8; ++orientation) {
    cv::Mat decoded = StoredAs(photo, orientation);
    if (IsMirrored(orientation)) cv::flip(decoded, decoded, 1);
    const cv::Mat upright = UprightView(decoded, orientation);
    ASSERT_EQ(upright.size(), photo.size()) << orientation;
    EXPECT_EQ(cv::norm(upright, photo, cv::NORM_INF), 0) << orientation;
  }
  EXPECT_EQ(StoredAs(photo, 5).size(), cv::Size(4, 6));
}

TEST(ExifOf, FindsWhatTheEncoderWrote) {
  ExifInfo info;
  info.make = "Skein";
  info.orientation = 7;
  const cv::Mat3b photo = SmoothPhoto();
  const Bytes exif = ExifOf(EncodePhoto(photo, &info, 90));
  EXPECT_EQ(exif, EncodeExif(info));

  const Bytes copy = WithExif(EncodePhoto(photo, nullptr, 50), exif);
  EXPECT_EQ(ReadExif(copy, {PhotoFormat::kJpeg, kSize.width, kSize.height}).orientation, 7);
}

TEST(ExifOf, IsEmptyWithoutEXIF) {
  EXPECT_TRUE(ExifOf(EncodePhoto(SmoothPhoto(), nullptr, 90)).empty());
  EXPECT_TRUE(ExifOf(Encode(SmoothPhoto(), ".png")).empty());
  EXPECT_TRUE(ExifOf({}).empty());
}

TEST(ExifOf, IsEmptyForASegmentThatIsCut) {
  Bytes jpeg = EncodePhoto(SmoothPhoto(), nullptr, 90);
  ExifInfo info;
  info.make = "Skein";
  Bytes with_exif = WithExif(std::move(jpeg), EncodeExif(info));
  with_exif.resize(20);
  EXPECT_TRUE(ExifOf(with_exif).empty());
}

}  // namespace skein::variants_test
