#include "depth/photo_table.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace skein::depth_test {
namespace {

LensCamera Lens(int width, int height, double k) {
  LensCamera lens{width, height, {0.8 * width, 0.8 * width}, {width / 2.0, height / 2.0}, {}};
  lens.project = [=](const Eigen::Vector2d& ray) {
    const Eigen::Vector2d bent = ray * (1 + k * ray.squaredNorm());
    return std::optional<Eigen::Vector2d>(Eigen::Vector2d(0.8 * width * bent.array()) +
                                          Eigen::Vector2d(width / 2.0, height / 2.0));
  };
  return lens;
}

TEST(PhotoTable, HalvesAPhotoWithoutDistortion) {
  cv::Mat1b photo(120, 160);
  for (int x = 0; x < 160; ++x) photo.col(x) = x;
  const DepthPhoto half = PhotoTable(Lens(160, 120, 0), 80).Apply(photo, {});
  EXPECT_EQ(half.grey.size(), cv::Size(80, 60));
  EXPECT_EQ(half.camera.focal_px.x(), 64);
  EXPECT_EQ(half.camera.principal_point_px, Eigen::Vector2d(40, 30));
  EXPECT_NEAR(half.grey(30, 40), 80, 1);
  EXPECT_EQ(cv::countNonZero(half.valid), 80 * 60);
}

TEST(PhotoTable, UndoesDistortion) {
  const LensCamera lens = Lens(160, 120, -0.1);
  cv::Mat1b photo(120, 160);
  for (int x = 0; x < 160; ++x) photo.col(x) = x;
  const DepthPhoto freed = PhotoTable(lens, 160).Apply(photo, {});
  const Eigen::Vector2d pixel(140.5, 100.5);
  const double expected = (*lens.project(freed.camera.Ray(pixel))).x() - 0.5;
  EXPECT_NEAR(freed.grey(100, 140), expected, 1);
}

TEST(PhotoTable, WhatThePhotoDoesNotShowIsInvalid) {
  const DepthPhoto freed =
      PhotoTable(Lens(160, 120, 0.2), 160).Apply(cv::Mat1b(120, 160, uint8_t{9}), {});
  EXPECT_EQ(freed.valid(0, 0), 0);
  EXPECT_NE(freed.valid(60, 80), 0);
}

// r (1 - 0.8 r^2) turns back at r = 0.65: beyond it the photo's middle would come again.
TEST(PhotoTable, ALensThatTurnsBackShowsNothingTwice) {
  const DepthPhoto freed =
      PhotoTable(Lens(160, 120, -0.8), 160).Apply(cv::Mat1b(120, 160, uint8_t{9}), {});
  EXPECT_EQ(freed.valid(4, 4), 0) << "r = 0.7";
  EXPECT_EQ(freed.valid(0, 0), 0) << "r = 0.8";
  EXPECT_NE(freed.valid(60, 12), 0) << "r = 0.53";
}

// r (1 - 4 r^2) turns back at r = 0.29 and is below 0 from r = 0.5 on: the middle, upside down.
TEST(PhotoTable, ALensThatTurnsBackBeyondItsZeroShowsNothingUpsideDown) {
  const DepthPhoto freed =
      PhotoTable(Lens(160, 120, -4), 160).Apply(cv::Mat1b(120, 160, uint8_t{9}), {});
  EXPECT_EQ(freed.valid(60, 150), 0) << "r = 0.55";
  EXPECT_NE(freed.valid(60, 110), 0) << "r = 0.24";
}

TEST(PhotoTable, FortyMegapixelsBecomeTheSizeThatIsWanted) {
  const PhotoTable table(Lens(7728, 5152, -0.02), 800);
  EXPECT_EQ(table.camera().width, 800);
  EXPECT_EQ(table.camera().height, 533);
  EXPECT_EQ(table.Apply(cv::Mat1b(5152, 7728, uint8_t{50}), {}).grey.cols, 800);
}

TEST(PhotoTable, TakesAPhotoThatItsDecoderHasReduced) {
  cv::Mat1b photo(60, 81);
  for (int x = 0; x < 81; ++x) photo.col(x) = 2 * x;
  const DepthPhoto small = PhotoTable(Lens(161, 119, 0), 40).Apply(photo, {});
  EXPECT_EQ(small.grey.cols, 40);
  EXPECT_NEAR(small.grey(15, 20), 80, 3);
}

TEST(PhotoTable, RefusesAnotherSize) {
  EXPECT_THROW(PhotoTable(Lens(160, 120, 0), 80).Apply(cv::Mat1b(100, 160), {}),
               std::invalid_argument);
  EXPECT_THROW(PhotoTable(Lens(160, 120, 0), 0), std::invalid_argument);
}

}  // namespace
}  // namespace skein::depth_test
