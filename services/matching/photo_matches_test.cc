#include "matching/photo_matches.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "matching/feature_cache.h"
#include "testing/synthetic_features.h"

namespace skein::photo_matches_test {

PhotoMatches Match(const PhotoFeatures& photo, const std::vector<PhotoFeaturesPtr>& others) {
  PairMatcher matcher;
  PhotoMatches matches;
  for (const auto& other : others) matches.Add(other->image_id, matcher.Match(photo, *other));
  matches.Conclude(photo.points);
  return matches;
}

TEST(PhotoMatches, KeepVerifiedPairsMostInliersFirst) {
  SyntheticFeatures world;
  const auto photo = world.Photo(9, 0, 400);
  const std::vector<PhotoFeaturesPtr> others{world.Photo(2, 0.5, 100), world.Photo(5, 1, 0),
                                             world.Photo(3, 1.0, 300)};
  const PhotoMatches matches = Match(*photo, others);
  EXPECT_EQ(matches.num_tried, 3);
  EXPECT_GT(matches.match_s, 0);
  EXPECT_GT(matches.verify_s, 0);
  ASSERT_EQ(matches.pairs.size(), 2u);
  EXPECT_EQ(matches.pairs[0].other_id, 3);
  EXPECT_EQ(matches.pairs[1].other_id, 2);
  EXPECT_GE(matches.pairs[0].inliers.size(), 295u);
  EXPECT_EQ(matches.pairs[0].geometry, TwoViewGeometry::CALIBRATED);
  EXPECT_NEAR(matches.pairs[0].tvec[0], -1, 1e-3);  // other_from_photo
  EXPECT_GT(matches.pairs[0].tri_angle_rad, 0.05);
  for (const auto& [in_photo, in_other] : matches.pairs[0].inliers) EXPECT_EQ(in_photo, in_other);
}

TEST(PhotoMatches, FundamentalMatrixMapsPhotoToOther) {
  SyntheticFeatures world;
  const auto photo = world.Photo(9, 0, 400), other = world.Photo(2, 0.5, 300);
  const PhotoMatches matches = Match(*photo, {other});
  ASSERT_EQ(matches.pairs.size(), 1u);
  const Eigen::Matrix3d F =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(matches.pairs[0].F.data());
  for (const auto& [i, j] : matches.pairs[0].inliers) {
    const Eigen::Vector3d line = F * photo->points[i].homogeneous();
    EXPECT_LT(std::abs(line.dot(other->points[j].homogeneous())) / line.head<2>().norm(), 8);
  }
}

TEST(PhotoMatches, DoNotDependOnTheOrderOfTheirPairs) {
  SyntheticFeatures world;
  const auto photo = world.Photo(9, 0, 400);
  std::vector<PhotoFeaturesPtr> others;
  for (int i = 1; i < 8; ++i) others.push_back(world.Photo(i, 0.2 * i, 30 * (1 + i / 2)));
  const PhotoMatches forwards = Match(*photo, others);
  std::reverse(others.begin(), others.end());
  EXPECT_EQ(EncodeTwoViewPairs(forwards.pairs), EncodeTwoViewPairs(Match(*photo, others).pairs));
}

TEST(PhotoMatches, WithoutCandidatesOrFeaturesThereAreNoPairs) {
  SyntheticFeatures world;
  auto empty = std::make_shared<PhotoFeatures>();
  empty->camera = PriorCamera(SyntheticFeatures::kSizePx, SyntheticFeatures::kSizePx,
                              SyntheticFeatures::kFocalPx, true);
  EXPECT_EQ(Match(*world.Photo(1, 0, 400), {}).num_tried, 0);
  EXPECT_TRUE(Match(*world.Photo(1, 0, 400), {empty}).pairs.empty());
  EXPECT_TRUE(Match(*empty, {world.Photo(1, 0, 400)}).pairs.empty());
}

PairResult StillPair(int num_still, int num_moving) {
  PairResult pair;
  pair.geometry.config = TwoViewGeometry::PANORAMIC;
  for (int i = 0; i < num_still + num_moving; ++i) {
    pair.geometry.inlier_matches.emplace_back(i, i);
    pair.stand_still.push_back(i < num_still);
  }
  return pair;
}

// Photo 3 stands still against 1 and 2, by 300 matches.
std::vector<int64_t> PairsOfPhoto3(const std::vector<PairApart>& apart, int num_moving = 0) {
  PhotoMatches matches;
  matches.Add(1, StillPair(300 - num_moving, num_moving));
  matches.Add(2, StillPair(300 - num_moving, num_moving));
  matches.Conclude(std::vector<Eigen::Vector2d>(300, Eigen::Vector2d(50, 50)), apart);
  std::vector<int64_t> others;
  for (const TwoViewPair& pair : matches.pairs) others.push_back(pair.other_id);
  return others;
}

TEST(PhotoMatches, LeaveOutTheBackgroundOfPhotosThatAreApart) {
  EXPECT_TRUE(PairsOfPhoto3({{1, 2, 150}}).empty());
}

TEST(PhotoMatches, KeepABurstATripodAndADistantScene) {
  const std::vector<int64_t> both{1, 2};
  EXPECT_EQ(PairsOfPhoto3({}), both);
  EXPECT_EQ(PairsOfPhoto3({{1, 4, 150}, {2, 5, 150}}), both) << "by a photo of another spot";
  EXPECT_EQ(PairsOfPhoto3({{1, 2, 400}}), both) << "all that stands still is apart, too";
  EXPECT_EQ(PairsOfPhoto3({{1, 2, 150}}, 30), both) << "a part moves with the camera";
}

TEST(PhotoMatches, AreApartByAnEpipolarGeometryThatAMapCouldBeginWith) {
  CovisibilityGraph graph;
  graph.Add(1, {2, 150, 1, 0.1F, 0, TwoViewGeometry::UNCALIBRATED});
  graph.Add(1, {3, 900, 2, 0, 0, TwoViewGeometry::PANORAMIC});
  graph.Add(2, {3, 99, 3, 0.1F, 0, TwoViewGeometry::CALIBRATED});
  graph.Add(2, {4, 150, 4, 0.1F, 0, TwoViewGeometry::CALIBRATED});
  const std::vector<PairApart> apart = PairsApart(graph, {3, 2, 1, 7});
  ASSERT_EQ(apart.size(), 1u);
  EXPECT_EQ(apart[0].id1, 1);
  EXPECT_EQ(apart[0].id2, 2);
  EXPECT_EQ(apart[0].num_inliers, 150);
}

class PhotoFeaturesBlobs : public testing::Test {
 protected:
  Result<PhotoFeaturesPtr> Decode() {
    return DecodePhotoFeatures(7,
                               PriorCamera(SyntheticFeatures::kSizePx, SyntheticFeatures::kSizePx,
                                           SyntheticFeatures::kFocalPx, false),
                               EncodeKeypoints(keypoints_), EncodeDescriptors(descriptors_));
  }

  Keypoints keypoints_ = Keypoints(3, Keypoint{10, 20, 2, 0, 1, 2, 3});
  Descriptors descriptors_{std::vector<uint8_t>(3 * kDescriptorDim, 9)};
};

TEST_F(PhotoFeaturesBlobs, Decode) {
  const auto features = Decode();
  ASSERT_TRUE(features.ok()) << features.error();
  EXPECT_EQ((*features)->image_id, 7);
  EXPECT_EQ((*features)->points.size(), 3u);
  EXPECT_EQ((*features)->points[1], Eigen::Vector2d(10, 20));
  EXPECT_EQ((*features)->descriptors, CompactDescriptors(descriptors_.data));
  EXPECT_EQ((*features)->index.coarsest.size(), 3u);
}

TEST_F(PhotoFeaturesBlobs, RefuseCountsThatDiffer) {
  keypoints_.pop_back();
  EXPECT_FALSE(Decode().ok());
}

TEST_F(PhotoFeaturesBlobs, RefuseKeypointsOutsideTheImageOrNotNumbers) {
  for (const float x : {-1.f, SyntheticFeatures::kSizePx + 1.f, std::nanf(""), INFINITY}) {
    keypoints_[1].x = x;
    EXPECT_FALSE(Decode().ok()) << x;
  }
}

TEST_F(PhotoFeaturesBlobs, RefuseDamagedBytes) {
  const Camera camera = PriorCamera(SyntheticFeatures::kSizePx, SyntheticFeatures::kSizePx,
                                    SyntheticFeatures::kFocalPx, false);
  Bytes damaged = EncodeDescriptors(descriptors_);
  damaged.pop_back();
  EXPECT_FALSE(DecodePhotoFeatures(7, camera, EncodeKeypoints(keypoints_), damaged).ok());
  EXPECT_FALSE(DecodePhotoFeatures(7, camera, {}, EncodeDescriptors(descriptors_)).ok());
}

PhotoFeaturesPtr Photo(int64_t id, size_t num_points) {
  auto photo = std::make_shared<PhotoFeatures>();
  photo->image_id = id;
  photo->points.resize(num_points);
  photo->descriptors.resize(num_points * kDescriptorDim);
  return photo;
}

TEST(FeatureCache, DropsWhatWasNotUsedForLongest) {
  const size_t one = Photo(1, 100)->MemoryBytes();
  FeatureCache cache(2 * one);
  cache.Insert(Photo(1, 100));
  cache.Insert(Photo(2, 100));
  EXPECT_TRUE(cache.Find(1));
  cache.Insert(Photo(3, 100));
  EXPECT_TRUE(cache.Find(1));
  EXPECT_FALSE(cache.Find(2));
  EXPECT_TRUE(cache.Find(3));
  EXPECT_EQ(cache.num_bytes(), 2 * one);
}

TEST(FeatureCache, ReplacesAndRefusesWhatIsTooLarge) {
  FeatureCache cache(Photo(1, 100)->MemoryBytes());
  cache.Insert(Photo(1, 100));
  cache.Insert(Photo(1, 50));
  EXPECT_EQ(cache.size(), 1u);
  EXPECT_EQ(cache.Find(1)->points.size(), 50u);
  cache.Insert(Photo(2, 200));
  EXPECT_FALSE(cache.Find(2));
  EXPECT_EQ(cache.num_bytes(), 0u);
}

}  // namespace skein::photo_matches_test
