#include "depth/consistency.h"

#include <gtest/gtest.h>

#include "depth/wall_photos.h"

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

TEST(KeepAgreed, ADepthBecomesTheMean) {
  const DepthMap map = TrueMap(kHere, 1.006), a = TrueMap(PoseAt({1, 0, 0})),
                 b = TrueMap(PoseAt({0, 1, 0}));
  const DepthMap kept = KeepAgreed(map, {&a, &b});
  ASSERT_GT(kept.depth(60, 80), 0);
  EXPECT_NEAR(kept.depth(60, 80) / TrueMap(kHere).depth(60, 80), 1.002, 0.001);
}

}  // namespace
}  // namespace skein::depth_test
