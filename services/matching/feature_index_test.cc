#include "matching/feature_index.h"

#include <gtest/gtest.h>

#include <cmath>

#include "matching/kernel.h"

namespace skein::feature_index_test {

using Points = std::vector<Eigen::Vector2d>;

std::vector<uint8_t> DescriptorsOf(size_t count) {
  std::vector<uint8_t> descriptors;
  for (size_t i = 0; i < count * kDescriptorDim; ++i)
    descriptors.push_back(i / kDescriptorDim % 256);
  return descriptors;
}

FeatureIndex IndexOf(const std::vector<float>& scales_px) {
  return MakeFeatureIndex(Points(scales_px.size(), Eigen::Vector2d(1, 2)), scales_px,
                          DescriptorsOf(scales_px.size()));
}

TEST(FeatureIndex, HasTheCoarsestFirstAndOfEqualOnesTheFirst) {
  const FeatureIndex index = IndexOf({2, 9, 2, 30});
  EXPECT_EQ(index.coarsest, (std::vector<uint32_t>{3, 1, 0, 2}));
  ASSERT_EQ(index.coarse_descriptors.size(), 4u * kDescriptorDim);
  EXPECT_EQ(index.coarse_descriptors[0], 3);
  EXPECT_EQ(index.coarse_descriptors[kDescriptorDim], 1);
  EXPECT_EQ(index.norm_sq, (std::vector<int32_t>{0, 128, 512, 1152}));
}

TEST(FeatureIndex, HasNoMoreThanItsLimit) {
  std::vector<float> scales_px(kMaxCoarse + 500, 1);
  scales_px.back() = 2;
  const FeatureIndex index = IndexOf(scales_px);
  ASSERT_EQ(index.coarsest.size(), static_cast<size_t>(kMaxCoarse));
  EXPECT_EQ(index.coarsest[0], scales_px.size() - 1);
  EXPECT_EQ(index.coarsest[1], 0u);
}

TEST(FeatureIndex, TakesAScaleThatIsNoNumberForTheFinest) {
  EXPECT_EQ(IndexOf({std::nanf(""), 1, std::nanf(""), 2}).coarsest,
            (std::vector<uint32_t>{3, 1, 0, 2}));
}

TEST(FeatureIndex, IsEmptyWithoutFeatures) { EXPECT_TRUE(IndexOf({}).coarsest.empty()); }

TEST(FeatureIndex, RefusesCountsThatDiffer) {
  EXPECT_THROW(MakeFeatureIndex(Points(2, Eigen::Vector2d::Zero()), {1}, DescriptorsOf(2)),
               std::invalid_argument);
  EXPECT_THROW(MakeFeatureIndex(Points(2, Eigen::Vector2d::Zero()), {1, 1}, DescriptorsOf(1)),
               std::invalid_argument);
}

}  // namespace skein::feature_index_test
