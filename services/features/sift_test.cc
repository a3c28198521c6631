#include "features/sift.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace skein {
namespace {

// A bright Gaussian blob with its centre at `centre` (pixel centres at 0.5) on grey.
cv::Mat Blob(cv::Size size, cv::Point2d centre, double sigma) {
  cv::Mat image(size, CV_8UC3);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const double dx = x + 0.5 - centre.x;
      const double dy = y + 0.5 - centre.y;
      const double value = 40 + 180 * std::exp(-(dx * dx + dy * dy) / (2 * sigma * sigma));
      image.at<cv::Vec3b>(y, x) = cv::Vec3b::all(cv::saturate_cast<uint8_t>(value));
    }
  }
  return image;
}

cv::Point2d OffsetOfNearest(const Keypoints& keypoints, cv::Point2d centre) {
  cv::Point2d best(1e9, 1e9);
  for (const auto& k : keypoints) {
    const cv::Point2d offset(k.x - centre.x, k.y - centre.y);
    if (cv::norm(offset) < cv::norm(best)) best = offset;
  }
  return best;
}

cv::Mat Texture(cv::Size size) {
  cv::Mat noise(size, CV_8UC3);
  cv::RNG rng(7);
  rng.fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(noise, noise, {}, 1.5);
  cv::normalize(noise, noise, 0, 255, cv::NORM_MINMAX);
  return noise;
}

TEST(Sift, FindsBlobsAtTheirCentresAtAnySubpixelPhaseAndScale) {
  for (const double sigma : {1.5, 2.0, 3.0, 6.0, 12.0}) {
    cv::Point2d sum(0, 0);
    int count = 0;
    for (const double fx : {0.0, 0.2, 0.5, 0.7}) {
      for (const double fy : {0.1, 0.4, 0.9}) {
        const cv::Point2d centre(150 + fx, 120 + fy);
        const auto features = ExtractSift(Blob({303, 241}, centre, sigma), {});
        const cv::Point2d offset = OffsetOfNearest(features.keypoints, centre);
        if (cv::norm(offset) > 1) continue;
        sum += offset;
        ++count;
      }
    }
    ASSERT_GE(count, 6) << "sigma " << sigma;
    EXPECT_NEAR(sum.x / count, 0, 0.03) << "sigma " << sigma;
    EXPECT_NEAR(sum.y / count, 0, 0.03) << "sigma " << sigma;
  }
}

TEST(Sift, MapsKeypointsOfAShrunkPhotoToItsFullResolution) {
  const cv::Point2d centre(1203.3, 850.8);
  SiftOptions options;
  options.max_image_px = 800;
  const auto features = ExtractSift(Blob({2400, 1700}, centre, 18), options);
  const cv::Point2d offset = OffsetOfNearest(features.keypoints, centre);
  EXPECT_NEAR(offset.x, 0, 0.15);
  EXPECT_NEAR(offset.y, 0, 0.15);
}

TEST(Sift, PhotoWithoutTextureHasNoKeypoints) {
  const auto features = ExtractSift(cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(90)), {});
  EXPECT_TRUE(features.keypoints.empty());
  EXPECT_EQ(features.descriptors.rows(), 0u);
}

TEST(Sift, TinyPhotosHaveNoKeypoints) {
  for (const int side : {1, 2, 5}) {
    EXPECT_TRUE(
        ExtractSift(cv::Mat(side, side, CV_8UC3, cv::Scalar::all(9)), {}).keypoints.empty());
  }
}

TEST(Sift, KeepsAtMostTheLimitAndIsDeterministic) {
  const cv::Mat photo = Texture({640, 480});
  SiftOptions options;
  options.selection.max_features = 500;
  const auto first = ExtractSift(photo, options);
  const auto second = ExtractSift(photo, options);
  EXPECT_EQ(first.keypoints.size(), 500u);
  EXPECT_EQ(first.descriptors.rows(), 500u);
  EXPECT_EQ(first.descriptors.data, second.descriptors.data);
  for (size_t i = 0; i < 500; ++i) {
    EXPECT_EQ(first.keypoints[i].x, second.keypoints[i].x);
    EXPECT_EQ(first.keypoints[i].y, second.keypoints[i].y);
  }
}

TEST(Sift, TakesTheColourUnderTheKeypoint) {
  cv::Mat photo = Blob({200, 200}, {100, 100}, 5);
  std::vector<cv::Mat> bgr;
  cv::split(photo, bgr);
  bgr[0] /= 4;
  bgr[1] /= 2;
  cv::merge(bgr, photo);
  const auto features = ExtractSift(photo, {});
  ASSERT_FALSE(features.keypoints.empty());
  const Keypoint& k = features.keypoints[0];
  EXPECT_GT(k.r, k.g);
  EXPECT_GT(k.g, k.b);
}

TEST(RootSift, HasTheSquareRootOfEachShareTimes512) {
  cv::Mat sift = cv::Mat::zeros(3, 128, CV_32F);
  sift.row(0).setTo(3);                // equal shares
  sift.at<float>(1, 5) = 40;           // all in one bin: clamped
  const auto result = RootSift(sift);  // row 2 is all zero
  ASSERT_EQ(result.rows(), 3u);
  EXPECT_EQ(result.row(0)[17], std::lround(512 * std::sqrt(1.0 / 128)));
  EXPECT_EQ(result.row(1)[5], 255);
  EXPECT_EQ(result.row(1)[6], 0);
  EXPECT_EQ(result.row(2)[0], 0);
}

TEST(SelectKeypoints, LeavesWeakRegionsTheirShare) {
  std::vector<cv::KeyPoint> keypoints;
  for (int i = 0; i < 1000; ++i) keypoints.emplace_back(i % 32, i / 32, 2, 0, 1.f + i);
  for (int i = 0; i < 10; ++i) keypoints.emplace_back(600.f, 400.f + i, 2, 0, 0.01f);
  SelectionOptions options;
  options.max_features = 100;
  options.spread = 0.2;
  const auto selected = SelectKeypoints(keypoints, {640, 480}, options);
  ASSERT_EQ(selected.size(), 100u);
  int weak = 0;
  for (const int i : selected) weak += i >= 1000;
  EXPECT_EQ(weak, 10);
  EXPECT_EQ(selected[0], 999);
}

}  // namespace
}  // namespace skein
