#include "depth/depth_quality.h"

#include <gtest/gtest.h>

#include "testing/wall_photos.h"

namespace skein::depth_test {
namespace {

TEST(DepthQuality, ADepthThatIsNeitherAgreedNorContradictedIsAlone) {
  const DepthMap sweep = Wall().Map(PoseAt({0, 0, 0}), 0.01f);
  DepthMap kept = sweep;
  kept.depth = sweep.depth.clone();
  kept.depth.rowRange(0, 3) = 0;
  cv::Mat1b mask(kept.depth.size(), 255);
  mask.row(0) = 0;
  const DepthCounts counts = CountDepths(sweep, kept, mask);
  EXPECT_EQ(counts.agreed, (kWallHeight - 3) * kWallWidth);
  EXPECT_EQ(counts.contradicted, kWallWidth);
  EXPECT_EQ(counts.alone, 2 * kWallWidth);
}

TEST(DepthQuality, CountsAddUp) {
  const DepthCounts sum = SumOf({{1, 2, 3}, {10, 20, 30}});
  EXPECT_EQ(sum.agreed, 11);
  EXPECT_EQ(sum.contradicted, 22);
  EXPECT_EQ(sum.alone, 33);
  EXPECT_EQ(sum.Sum(), 66);
}

TEST(DepthQuality, PercentilesAreOfAllDepthsAndOfNoHole) {
  DepthMap low = Wall().Map(PoseAt({0, 0, 0}), 0.01f), high = Wall().Map(PoseAt({0, 0, 0}), 0.1f);
  low.error(0, 0) = 1000;  // of a hole
  low.depth(0, 0) = 0;
  high.depth.rowRange(kWallHeight / 2, kWallHeight) = 0;
  const ErrorPercentiles both = PercentilesOfErrors({low, high});
  EXPECT_NEAR(both.p50, 0.01, 0.01 / 512);
  EXPECT_NEAR(both.p95, 0.1, 0.1 / 512);
}

TEST(DepthQuality, HolesHaveNoErrors) {
  DepthMap map = Wall().Map(PoseAt({0, 0, 0}), 0.01f);
  map.depth = 0;
  EXPECT_EQ(PercentilesOfErrors({map}).p95, 0);
  EXPECT_EQ(PercentilesOfErrors({}).p50, 0);
}

}  // namespace
}  // namespace skein::depth_test
