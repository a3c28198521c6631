#include "features/vlad.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

#include "features/describe_photo.h"
#include "features/train_codebook.h"

namespace skein {
namespace {

std::vector<uint8_t> RandomDescriptors(size_t count, uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<uint8_t> data(count * Codebook::kDescriptorDim);
  for (uint8_t& value : data) value = static_cast<uint8_t>(random() % 100);
  return data;
}

Codebook SmallCodebook() {
  TrainingOptions options;
  options.local_dim = 24;
  options.num_cells = 8;
  options.cell_dim = 6;
  return TrainCodebook(RandomDescriptors(2000, 1), "small", options);
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

TEST(Codebook, TrainingIsDeterministicAndRefusesTooLittle) {
  EXPECT_EQ(EncodeCodebook(SmallCodebook()), EncodeCodebook(SmallCodebook()));
  EXPECT_THROW(TrainCodebook(RandomDescriptors(20, 1), "x", {}), std::invalid_argument);
}

TEST(Codebook, TheShippedOneLoadsAndIsSmall) {
  const std::string path = std::string(SKEIN_SOURCE_DIR) + "/data/vlad_codebook.bin";
  const auto codebook = LoadCodebook(path);
  ASSERT_TRUE(codebook.ok()) << codebook.error();
  EXPECT_LE(EncodeCodebook(*codebook).size(), size_t{4} << 20);
}

TEST(Vlad, HasUnitLengthAndDoesNotDependOnTheOrderOfDescriptors) {
  const VladModel model(SmallCodebook(), {});
  auto descriptors = RandomDescriptors(300, 2);
  const auto values = model.DescribeDescriptors(descriptors.data(), 300);
  ASSERT_EQ(values.size(), 48u);
  EXPECT_NEAR(Distance(values, std::vector<float>(48, 0)), 1, 1e-5);
  std::rotate(descriptors.begin(), descriptors.begin() + 128 * 100, descriptors.end());
  EXPECT_NEAR(Distance(values, model.DescribeDescriptors(descriptors.data(), 300)), 0, 1e-3);
}

TEST(Vlad, SharedDescriptorsBringPhotosNearer) {
  const VladModel model(SmallCodebook(), {});
  const auto a = RandomDescriptors(300, 2);
  auto half = RandomDescriptors(300, 3);
  const auto other = RandomDescriptors(300, 4);
  std::copy(a.begin(), a.begin() + 150 * 128, half.begin());
  const auto of = [&](const auto& d) { return model.DescribeDescriptors(d.data(), 300); };
  EXPECT_LT(Distance(of(a), of(half)), 0.9 * Distance(of(a), of(other)));
}

TEST(Vlad, NoDescriptorsGiveNoVector) {
  const VladModel model(SmallCodebook(), {});
  EXPECT_TRUE(model.DescribeDescriptors(nullptr, 0).empty());
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
  VladModel model(*codebook, {});
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

}  // namespace
}  // namespace skein
