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

const cv::Rect kSpot(78, 58, 5, 5);

int NumKept(const DepthMap& kept, const cv::Rect& area) {
  return cv::countNonZero(kept.depth(area));
}

// Each map is right here and there: three are seldom right at the same pixel.
TEST(KeepAgreed, OneAgreeingMapIsEnoughWhereTwoAgreeAround) {
  const DepthMap map = TrueMap(kHere), a = TrueMap(kHere);
  DepthMap b = TrueMap(kHere);
  b.depth(kSpot) *= 1.05;
  EXPECT_EQ(NumKept(KeepAgreed(map, {&a, &b}), kSpot), kSpot.area() - 1);
}

// As chance agrees.
TEST(KeepAgreed, APixelThatTwoAgreeWithAloneIsAHole) {
  const DepthMap map = TrueMap(kHere);
  DepthMap a = TrueMap(kHere, 1.05), b = TrueMap(kHere, 1.05);
  a.depth(60, 80) = b.depth(60, 80) = map.depth(60, 80);
  EXPECT_EQ(KeepAgreed(map, {&a, &b}).Completeness(), 0);
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

// The predicted error at the spot's upper edge, where `other` shows the spot `factor` times as far.
float ErrorAtSpot(double factor) {
  const DepthMap map = TrueMap(kHere), a = TrueMap(kHere, 1.003), b = TrueMap(kHere, 0.997);
  DepthMap other = TrueMap(kHere);
  other.depth(kSpot) *= factor;
  return KeepAgreed(map, {&a, &b, &other}).error(kSpot.y, kSpot.x + 2);
}

// The simulated "together", 48 photos: errors beside edges were 1.7 times those predicted.
TEST(KeepAgreed, WhereAMapSeesPastADepthItsErrorIsLarger) {
  EXPECT_GT(ErrorAtSpot(1.03), 1.5 * ErrorAtSpot(1));
  EXPECT_GT(ErrorAtSpot(1.05), ErrorAtSpot(1.03));
  EXPECT_NEAR(ErrorAtSpot(2), ErrorAtSpot(1.05), 1e-5);
}

// The simulated stockpile, whose rim few photos show: errors were 0.6 times those predicted.
TEST(KeepAgreed, AMapThatShowsNothingOrWhatHidesADepthLeavesItsError) {
  for (const double factor : {0.0, 0.9}) {
    EXPECT_LT(ErrorAtSpot(factor), 1.3 * ErrorAtSpot(1)) << factor;
  }
}

const cv::Rect kSquare(70, 50, 20, 20);

// The wall from here, its square `factor` times as far.
DepthMap MapWithSquare(double factor) {
  DepthMap map = TrueMap(kHere);
  map.depth(kSquare) *= factor;
  return map;
}

std::vector<DepthMap> ThreeOthers() {
  return {TrueMap(PoseAt({1, 0, 0})), TrueMap(PoseAt({0, 1, 0})), TrueMap(PoseAt({1, 1, 0}))};
}

int NumContradicted(const DepthMap& map, const std::vector<DepthMap>& others,
                    const std::vector<DepthMap>& agreed) {
  std::vector<const DepthMap*> of_others, of_agreed;
  for (const DepthMap& other : others) of_others.push_back(&other);
  for (const DepthMap& other : agreed) of_agreed.push_back(&other);
  return cv::countNonZero(StaticMask(map, of_others, of_agreed) == 0);
}

TEST(StaticMask, ADepthThatThreeOthersSeePastIsContradicted) {
  const std::vector<DepthMap> others = ThreeOthers(), two(others.begin(), others.begin() + 2);
  EXPECT_EQ(NumContradicted(MapWithSquare(0.5), others, others), kSquare.area());
  EXPECT_EQ(NumContradicted(MapWithSquare(0.5), two, two), 0);
  EXPECT_EQ(NumContradicted(MapWithSquare(1), others, others), 0);
}

TEST(StaticMask, AsManyThatAgreeOutweighThoseThatSeePast) {
  const DepthMap map = MapWithSquare(0.5);
  std::vector<DepthMap> others = ThreeOthers();
  others.insert(others.end(), 2, map);
  EXPECT_EQ(NumContradicted(map, others, others), kSquare.area());
  others.push_back(map);
  EXPECT_EQ(NumContradicted(map, others, others), 0);
}

TEST(StaticMask, DepthsThatAreNotAgreedContradictNothing) {
  const std::vector<DepthMap> others = ThreeOthers();
  std::vector<DepthMap> agreed = others;
  agreed[0].depth = cv::Mat1f(agreed[0].depth.size(), 0.0f);
  EXPECT_EQ(NumContradicted(MapWithSquare(0.5), others, agreed), 0);
}

TEST(StaticMask, ADepthBehindTheOthersOrWithinTheErrorsIsNot) {
  const std::vector<DepthMap> others = ThreeOthers();
  EXPECT_EQ(NumContradicted(MapWithSquare(2), others, others), 0)
      << "the others show a surface before it: it may be hidden";
  DepthMap vague = TrueMap(kHere, 0.9);
  vague.error = 1;
  EXPECT_EQ(NumContradicted(vague, others, others), 0);
}

// Each second column of the others' sweeps shows something before the point.
TEST(StaticMask, AnEdgeContradictsNothing) {
  const std::vector<DepthMap> agreed = ThreeOthers();
  std::vector<DepthMap> others = ThreeOthers();
  for (DepthMap& other : others) {
    for (int x = 0; x < kWallWidth; x += 2) other.depth.col(x).setTo(1);
  }
  EXPECT_EQ(NumContradicted(TrueMap(kHere, 0.5), others, agreed), 0);
}

}  // namespace
}  // namespace skein::depth_test
