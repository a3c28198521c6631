#include "photo/image_view.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "photo/exif.h"

namespace skein::image_view_test {

TEST(UprightView, BringsTheMarkedCornerToTheUpperLeft) {
  // Where the upright view's upper left pixel is stored, by orientation. A decoded photo is
  // unmirrored: flipped left to right where it is stored as a mirror image.
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
    cv::Mat decoded = stored;
    if (IsMirrored(orientation)) cv::flip(stored, decoded, 1);
    const cv::Mat view = UprightView(decoded, orientation);
    EXPECT_EQ(view.size(), upright) << orientation;
    EXPECT_EQ(view.at<cv::Vec3b>(0, 0)[0], 255) << orientation;
  }
}

TEST(ShrinkTo, NeverEnlarges) {
  EXPECT_EQ(ShrinkTo(cv::Mat(30, 40, CV_8UC3), 1600).size(), cv::Size(40, 30));
  EXPECT_EQ(ShrinkTo(cv::Mat(3000, 4000, CV_8UC3), 1600).size(), cv::Size(1600, 1200));
}

}  // namespace skein::image_view_test
