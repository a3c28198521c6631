#include "features/photo_quality.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace skein::photo_quality_test {

// Squares of many sizes and greys, as a place shows edges of many sizes.
cv::Mat Scene(cv::Size size) {
  cv::Mat image(size, CV_8UC3, cv::Scalar::all(128));
  cv::RNG random(3);
  for (int i = 0; i < 4000; ++i) {
    const cv::Point corner(random.uniform(0, size.width), random.uniform(0, size.height));
    const int side = 3 + static_cast<int>(60 * std::pow(random.uniform(0.0, 1.0), 3));
    cv::rectangle(image, {corner, cv::Size(side, side)}, cv::Scalar::all(random.uniform(40, 220)),
                  -1);
  }
  return image;
}

float BlurOf(const cv::Mat& image) { return MeasureQuality(image, {}).blur; }

TEST(PhotoQuality, ASharpPhotoIsFarFromABlurredOne) {
  const cv::Mat sharp = Scene({1600, 1200});
  EXPECT_LT(BlurOf(sharp), 0.35);
  cv::Mat out_of_focus, moved;
  cv::GaussianBlur(sharp, out_of_focus, {}, 10);
  EXPECT_GT(BlurOf(out_of_focus), 0.5);
  for (const cv::Size motion : {cv::Size(31, 1), cv::Size(1, 31)}) {
    cv::blur(sharp, moved, motion);
    EXPECT_GT(BlurOf(moved), 0.5) << motion;
  }
}

// What noise adds to a blurred photo is not sharp.
TEST(PhotoQuality, NoiseDoesNotSharpen) {
  cv::Mat blurred, noise(1200, 1600, CV_16SC3), sum;
  cv::GaussianBlur(Scene({1600, 1200}), blurred, {}, 25);
  cv::RNG(5).fill(noise, cv::RNG::NORMAL, 0, 1.5);
  blurred.convertTo(sum, CV_16SC3);
  sum += noise;
  sum.convertTo(blurred, CV_8UC3);
  EXPECT_GT(BlurOf(blurred), 0.5);
}

TEST(PhotoQuality, LightAndSizeHardlyMatterToIt) {
  const cv::Mat sharp = Scene({1600, 1200});
  cv::Mat half;
  cv::resize(sharp, half, {}, 0.5, 0.5, cv::INTER_AREA);
  EXPECT_NEAR(BlurOf(half), BlurOf(sharp), 0.05);
  EXPECT_NEAR(BlurOf(sharp * 0.3), BlurOf(sharp), 0.05);
}

TEST(PhotoQuality, BrightnessIsTheMeanGrey) {
  EXPECT_EQ(MeasureQuality(cv::Mat(600, 800, CV_8UC3, cv::Scalar::all(0)), {}).brightness, 0);
  EXPECT_NEAR(MeasureQuality(cv::Mat(600, 800, CV_8UC3, cv::Scalar::all(51)), {}).brightness, 0.2,
              0.001);
}

TEST(PhotoQuality, CoverageCountsFieldsWithKeypoints) {
  const cv::Mat image = Scene({800, 600});
  std::vector<Keypoint> keypoints(3);
  keypoints[0].x = keypoints[0].y = 1;
  keypoints[1].x = keypoints[1].y = 2;               // the same field
  keypoints[2].x = 799.9F, keypoints[2].y = 599.9F;  // the last field
  EXPECT_FLOAT_EQ(MeasureQuality(image, keypoints).coverage, 2.F / 64);
}

TEST(PhotoQuality, ATinyPhotoHasSomeBlur) {
  EXPECT_GE(BlurOf(cv::Mat(4, 4, CV_8UC3, cv::Scalar::all(9))), 0);
}

// At the sizes at which quality and texture are measured, half a pixel is left of the shorter side.
TEST(PhotoQuality, AStripIsMeasured) {
  for (const cv::Size size : {cv::Size(65000, 20), cv::Size(20, 65000)}) {
    const cv::Mat strip(size, CV_8UC3, cv::Scalar::all(51));
    EXPECT_NEAR(MeasureQuality(strip, {}).brightness, 0.2, 0.001) << size;
  }
}

}  // namespace skein::photo_quality_test
