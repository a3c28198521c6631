#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "core/angles.h"
#include "testing/submap_rig.h"
#include "testing/test_random.h"

namespace skein::submap_equal_sides_test {

// A globe on a plinth whose four sides are equal, and photos all around. A pair of photos that see
// different parts of the globe matches by two sides that are taken for one.
constexpr int kGlobePoints = 900, kSidePoints = 90, kPhotos = 24;

struct Column {
  SyntheticScene scene;
  std::vector<Eigen::Vector3d> normals;  // of the points
};

void AddGlobe(std::mt19937* random, Column* column) {
  for (int i = 0; i < kGlobePoints; ++i) {
    column->normals.push_back(Normal3(1, random).normalized());
    column->scene.points.push_back(column->normals.back());
  }
}

void AddPlinth(std::mt19937* random, Column* column) {
  std::vector<Eigen::Vector3d> side;
  for (int i = 0; i < kSidePoints; ++i)
    side.emplace_back(Uniform(-0.6, 0.6, random), Uniform(1.1, 2.1, random), -0.6);
  for (int k = 0; k < 4; ++k) {
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(DegToRad(90 * k), Eigen::Vector3d::UnitY()).matrix();
    for (const Eigen::Vector3d& point : side) {
      column->scene.points.push_back(turn * point);
      column->normals.push_back(turn * Eigen::Vector3d(0, 0, -1));
    }
  }
}

void AddRing(std::mt19937* random, Column* column) {
  for (int i = 0; i < kPhotos; ++i) {
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(DegToRad(360.0 * i / kPhotos), Eigen::Vector3d::UnitY()).matrix();
    column->scene.AddPose(turn,
                          turn.transpose() * Eigen::Vector3d(0, 0.5, -5) + Normal3(0.05, random));
  }
}

// Keypoint of each point in a photo; -1: none, or it is seen from behind or at a grazing angle.
std::vector<int> KeypointsOf(const Column& column, size_t photo) {
  std::vector<int> keypoints(column.scene.points.size(), -1);
  const std::vector<int>& visible = column.scene.visible[photo];
  for (size_t k = 0; k < visible.size(); ++k) {
    const int point = visible[k];
    const Eigen::Vector3d to_photo =
        (column.scene.Center(photo) - column.scene.points[point]).normalized();
    if (to_photo.dot(column.normals[point]) > std::cos(DegToRad(65)))
      keypoints[point] = static_cast<int>(k);
  }
  return keypoints;
}

// With the plinth of the second photo turned by so many sides, and then without its globe.
TwoViewPair MatchesOf(const std::vector<int>& first, const std::vector<int>& second, int turned) {
  TwoViewPair pair;
  for (int i = turned == 0 ? 0 : kGlobePoints; i < static_cast<int>(first.size()); ++i) {
    const int of_side = i - kGlobePoints;
    const int j =
        i < kGlobePoints ? i : kGlobePoints + (of_side + turned * kSidePoints) % (4 * kSidePoints);
    if (first[i] >= 0 && second[j] >= 0) pair.inliers.emplace_back(first[i], second[j]);
  }
  return pair;
}

// As verification finds them: one relative pose a pair, that of most matches.
TwoViewPairs PairsOf(const std::vector<std::vector<int>>& keypoints, size_t photo) {
  TwoViewPairs pairs;
  for (size_t other = 0; other < photo; ++other) {
    TwoViewPair best;
    for (int turned = 0; turned < 4; ++turned) {
      TwoViewPair pair = MatchesOf(keypoints[photo], keypoints[other], turned);
      if (pair.inliers.size() > best.inliers.size()) best = pair;
    }
    best.other_id = static_cast<int64_t>(other) + 1;
    if (best.inliers.size() >= 15) pairs.push_back(best);
  }
  return pairs;
}

SyntheticScene MakeColumn(int seed) {
  std::mt19937 random(seed);
  Column column;
  AddGlobe(&random, &column);
  AddPlinth(&random, &column);
  AddRing(&random, &column);
  Photograph({}, &random, &column.scene);
  std::vector<std::vector<int>> keypoints;
  for (size_t i = 0; i < kPhotos; ++i) {
    keypoints.push_back(KeypointsOf(column, i));
    column.scene.pairs[i] = PairsOf(keypoints, i);
  }
  return column.scene;
}

// Seed of the column, and the step from a photo to the next one that comes.
class EqualSides : public testing::TestWithParam<std::pair<int, int>> {};

// Photos of all sides come mixed, or one side after the other. A photo that more pairs contradict
// than confirm may stay out.
TEST_P(EqualSides, AreNotLaidOnEachOther) {
  const auto [seed, stride] = GetParam();
  SubmapRig run(SyntheticOptions{});
  run.scene = MakeColumn(seed);
  ASSERT_TRUE(run.Start(0, 1, 4));
  for (size_t i = 0; i < kPhotos; ++i) {
    const size_t photo = i * stride % kPhotos;
    if (photo > 1) run.Feed(photo);
  }
  Submap::Batch place;
  place.is_of_place = true;
  run.map.MapAsBatch(place, run.Sink());
  run.map.Finish(run.Sink());
  EXPECT_GE(run.NumRegistered(), 3 * kPhotos / 4);
  EXPECT_LT(run.PositionErrorPercent(), 0.3);
}

INSTANTIATE_TEST_SUITE_P(SeedsAndStrides, EqualSides,
                         testing::Values(std::pair(1, 7), std::pair(2, 5), std::pair(3, 7),
                                         std::pair(4, 7)));

}  // namespace skein::submap_equal_sides_test
