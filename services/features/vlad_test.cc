#include "features/vlad.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

#include "core/hash.h"
#include "core/local_descriptor.h"
#include "features/describe_photo.h"
#include "features/train_codebook.h"

namespace skein::vlad_test {

LocalFeatures RandomFeatures(size_t count, uint32_t seed) {
  std::mt19937 random(seed);
  LocalFeatures features;
  features.keypoints.resize(count);
  for (auto& keypoint : features.keypoints) keypoint.scale_px = 2.f + random() % 1000 / 500.f;
  features.descriptors.data.resize(count * kDescriptorDim);
  for (uint8_t& value : features.descriptors.data) value = static_cast<uint8_t>(random() % 100);
  return features;
}

Codebook SmallCodebook() {
  TrainingOptions options;
  options.local_dim = 24;
  options.num_cells = 8;
  options.cell_dim = 6;
  return TrainCodebook({RandomFeatures(1000, 11), RandomFeatures(1000, 12)}, "small", options);
}

double Distance(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum);
}

TEST(Codebook, ComesBackFromItsFileAsItWas) {
  const Codebook codebook = SmallCodebook();
  const auto back = DecodeCodebook(EncodeCodebook(codebook));
  ASSERT_TRUE(back.ok()) << back.error();
  EXPECT_EQ(back->id, "small");
  EXPECT_EQ(back->centres, codebook.centres);
  EXPECT_EQ(back->cell_axes, codebook.cell_axes);
  EXPECT_EQ(back->projection, codebook.projection);
}

TEST(Codebook, DamageAndFutureVersionsAreNoticed) {
  const Bytes bytes = EncodeCodebook(SmallCodebook());
  for (size_t i = 0; i < bytes.size(); i += 101) {
    Bytes damaged = bytes;
    damaged[i] ^= 4;
    EXPECT_FALSE(DecodeCodebook(damaged).ok()) << "byte " << i;
  }
  EXPECT_FALSE(DecodeCodebook({}).ok());
  EXPECT_FALSE(DecodeCodebook(Bytes(bytes.begin(), bytes.end() - 1)).ok());
  Bytes future = bytes;
  future[4] = 9;
  EXPECT_NE(DecodeCodebook(future).error().find("version 9"), std::string::npos);
}

TEST(Codebook, ForAnotherAggregationIsRefused) {
  Bytes bytes = EncodeCodebook(SmallCodebook());
  bytes.at(17) ^= 1;  // of kVladFeatures: behind identifier, version and "small"
  bytes.resize(bytes.size() - 64);
  const std::string checksum = HashBytes(bytes.data(), bytes.size());
  bytes.insert(bytes.end(), checksum.begin(), checksum.end());
  EXPECT_NE(DecodeCodebook(bytes).error().find("another way"), std::string::npos);
}

TEST(Codebook, TrainingIsDeterministicAndRefusesTooLittle) {
  EXPECT_EQ(EncodeCodebook(SmallCodebook()), EncodeCodebook(SmallCodebook()));
  EXPECT_THROW(TrainCodebook({RandomFeatures(20, 1)}, "x", {}), std::invalid_argument);
}

TEST(Codebook, TheShippedOneLoadsAndIsSmall) {
  const std::string path = std::string(SKEIN_SOURCE_DIR) + "/data/vlad_codebook.bin";
  const auto codebook = LoadCodebook(path);
  ASSERT_TRUE(codebook.ok()) << codebook.error();
  EXPECT_LE(EncodeCodebook(*codebook).size(), size_t{4} << 20);
}

TEST(Vlad, HasUnitLengthAndDoesNotDependOnTheOrderOfFeatures) {
  const VladModel model(SmallCodebook());
  auto features = RandomFeatures(300, 2);
  const auto values = model.DescribeFeatures(features);
  ASSERT_EQ(values.size(), 48u);
  EXPECT_NEAR(Distance(values, std::vector<float>(48, 0)), 1, 1e-5);
  auto& data = features.descriptors.data;
  std::rotate(data.begin(), data.begin() + 128 * 100, data.end());
  std::rotate(features.keypoints.begin(), features.keypoints.begin() + 100,
              features.keypoints.end());
  EXPECT_NEAR(Distance(values, model.DescribeFeatures(features)), 0, 1e-3);
}

TEST(Vlad, SharedDescriptorsBringPhotosNearer) {
  const VladModel model(SmallCodebook());
  const auto a = RandomFeatures(300, 2);
  auto half = RandomFeatures(300, 3);
  std::copy(a.keypoints.begin(), a.keypoints.begin() + 150, half.keypoints.begin());
  std::copy(a.descriptors.data.begin(), a.descriptors.data.begin() + 150 * 128,
            half.descriptors.data.begin());
  const auto of = [&](const auto& features) { return model.DescribeFeatures(features); };
  EXPECT_LT(Distance(of(a), of(half)), 0.9 * Distance(of(a), of(RandomFeatures(300, 4))));
}

TEST(Vlad, UsesTheLargestFeaturesOnly) {
  const VladModel model(SmallCodebook());
  constexpr size_t kNumFeatures = kVladFeatures + 200;
  auto features = RandomFeatures(kNumFeatures, 2);
  for (size_t i = kVladFeatures; i < kNumFeatures; ++i) features.keypoints[i].scale_px = 1;
  auto first = features;
  first.keypoints.resize(kVladFeatures);
  first.descriptors.data.resize(kVladFeatures * 128);
  EXPECT_EQ(model.DescribeFeatures(features), model.DescribeFeatures(first));
}

TEST(Vlad, NoFeaturesGiveNoVector) {
  EXPECT_TRUE(VladModel(SmallCodebook()).DescribeFeatures({}).empty());
}

TEST(Vlad, PhotoStoredSidewaysIsNearItself) {
  cv::Mat photo(400, 500, CV_8UC3);
  cv::RNG(3).fill(photo, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(photo, photo, {}, 2);
  cv::normalize(photo, photo, 0, 255, cv::NORM_MINMAX);
  cv::Mat turned;
  cv::rotate(photo, turned, cv::ROTATE_90_CLOCKWISE);
  auto codebook = LoadCodebook(std::string(SKEIN_SOURCE_DIR) + "/data/vlad_codebook.bin");
  ASSERT_TRUE(codebook.ok());
  VladModel model(*codebook);
  const auto of = [&](const cv::Mat& image) {
    const LocalFeatures features = ExtractSift(image, {});
    return model.Describe({image, 1, &features});
  };
  EXPECT_LT(Distance(of(photo), of(turned)), 0.35);
}

TEST(AugmentPhoto, IsDeterministicAndChangesThePhoto) {
  const cv::Mat photo(120, 160, CV_8UC3, cv::Scalar(20, 90, 160));
  const cv::Mat view = AugmentPhoto(photo, 4);
  EXPECT_EQ(view.size(), photo.size());
  EXPECT_EQ(cv::norm(view, AugmentPhoto(photo, 4)), 0);
  EXPECT_GT(cv::norm(view, photo), 0);
}

}  // namespace skein::vlad_test
