#include "depth/consistency.h"

#include <gtest/gtest.h>

#include "testing/wall_photos.h"

namespace skein::depth_test {
namespace {

// The wall's true depths, times `factor`.
DepthMap TrueMap(const DepthPose& pose, double factor = 1) {
  DepthMap map = Wall().Map(pose, 0.02f);
  map.depth *= factor;
  return map;
}

const DepthPose kHere = PoseAt({0, 0, 0});

TEST(KeepAgreed, KeepsWhatTwoOthersSee) {
  const DepthMap map = TrueMap(kHere), a = TrueMap(PoseAt({1, 0, 0})),
                 b = TrueMap(PoseAt({0, 1, 0}, 0, 0.5));
  const DepthMap kept = KeepAgreed(map, {&a, &b});
  EXPECT_GT(kept.Completeness(), 0.6);
  EXPECT_NEAR(kept.depth(60, 80), map.depth(60, 80), 0.01);
  EXPECT_LT(kept.error(60, 80), 0.02);
  EXPECT_GT(kept.error(60, 80), 0);
}

TEST(KeepAgreed, OneAgreeingMapIsNotEnough) {
  const DepthMap map = TrueMap(kHere), a = TrueMap(PoseAt({1, 0, 0})),
                 wrong = TrueMap(PoseAt({0, 1, 0}), 1.05);
  EXPECT_EQ(KeepAgreed(map, {&a, &wrong}).Completeness(), 0);
  EXPECT_EQ(KeepAgreed(map, {&a}).Completeness(), 0);
  EXPECT_EQ(KeepAgreed(map, {}).Completeness(), 0);
}

TEST(KeepAgreed, AMapOfHolesAgreesWithNothing) {
  const DepthMap map = TrueMap(kHere), a = TrueMap(PoseAt({1, 0, 0}));
  DepthMap holes = TrueMap(PoseAt({0, 1, 0}));
  holes.depth = 0;
  EXPECT_EQ(KeepAgreed(map, {&a, &holes}).Completeness(), 0);
}

// A square of `map` lies half as far as the wall.
TEST(KeepAgreed, ADepthThatTwoOthersSeePastIsContradicted) {
  const DepthMap a = TrueMap(PoseAt({1, 0, 0})), b = TrueMap(PoseAt({0, 1, 0}));
  DepthMap map = TrueMap(kHere);
  map.depth(cv::Rect(70, 50, 20, 20)) *= 0.5;
  DepthCounts counts;
  KeepAgreed(map, {&a, &b}, &counts);
  EXPECT_EQ(counts.contradicted, 400);
  EXPECT_GT(counts.agreed, kWallWidth * kWallHeight / 2);
  EXPECT_EQ(counts.Sum(), kWallWidth * kWallHeight);
  KeepAgreed(map, {&a}, &counts);
  EXPECT_EQ(counts.contradicted, 0) << "by one other";
  EXPECT_EQ(counts.alone, kWallWidth * kWallHeight);
}

TEST(KeepAgreed, ADepthBehindTheOthersOrWithinTheErrorsIsAlone) {
  const DepthMap a = TrueMap(PoseAt({1, 0, 0})), b = TrueMap(PoseAt({0, 1, 0}));
  DepthMap map = TrueMap(kHere);
  map.depth(cv::Rect(70, 50, 20, 20)) *= 2;
  DepthCounts counts;
  KeepAgreed(map, {&a, &b}, &counts);
  EXPECT_EQ(counts.contradicted, 0) << "the others show a surface before it: it may be hidden";
  map = TrueMap(kHere, 0.9);
  map.error = 1;
  KeepAgreed(map, {&a, &b}, &counts);
  EXPECT_EQ(counts.agreed + counts.contradicted, 0);
}

TEST(KeepAgreed, AnEdgeContradictsNothing) {
  DepthMap a = TrueMap(PoseAt({1, 0, 0})), b = TrueMap(PoseAt({0, 1, 0}));
  DepthMap map = TrueMap(kHere, 0.5);
  // Each second column of the others shows something before the point.
  for (int x = 0; x < kWallWidth; x += 2) {
    a.depth.col(x).setTo(1);
    b.depth.col(x).setTo(1);
  }
  DepthCounts counts;
  KeepAgreed(map, {&a, &b}, &counts);
  EXPECT_EQ(counts.contradicted, 0);
}

TEST(KeepAgreed, ADepthBecomesTheMean) {
  const DepthMap map = TrueMap(kHere, 1.006), a = TrueMap(PoseAt({1, 0, 0})),
                 b = TrueMap(PoseAt({0, 1, 0}));
  const DepthMap kept = KeepAgreed(map, {&a, &b});
  ASSERT_GT(kept.depth(60, 80), 0);
  EXPECT_NEAR(kept.depth(60, 80) / TrueMap(kHere).depth(60, 80), 1.002, 0.001);
}

}  // namespace
}  // namespace skein::depth_test
