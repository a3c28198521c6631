#include "matching/overlay.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <random>

#include "testing/test_random.h"

namespace skein::overlay_test {

constexpr int kWidthPx = 1600, kHeightPx = 1200;
constexpr double kFocalPx = 1300;
constexpr int kNumUnmatched = 2000;  // keypoints all over each photo

// Two photos and their putative matches.
class Overlay : public testing::Test {
 protected:
  Overlay() {
    for (PhotoFeatures* photo : {&first_, &second_}) {
      photo->camera = PriorCamera(kWidthPx, kHeightPx, kFocalPx, true);
      for (int i = 0; i < kNumUnmatched; ++i) photo->points.push_back(Anywhere());
    }
    first_.image_id = 2;
    second_.image_id = 1;
  }

  Eigen::Vector2d Anywhere() {
    const double x = Uniform(0, kWidthPx, &random_);
    return {x, Uniform(0, kHeightPx, &random_)};
  }

  void AddMatch(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    const auto noisy = [this](const Eigen::Vector2d& pixel) {
      return Eigen::Vector2d(pixel.x() + Uniform(-0.5, 0.5, &random_),
                             pixel.y() + Uniform(-0.5, 0.5, &random_));
    };
    matches_.emplace_back(first_.points.size(), second_.points.size());
    first_.points.push_back(noisy(a));
    second_.points.push_back(noisy(b));
  }

  // Points at depths `near` to `far`; the second camera is turned by R, then moved by t.
  void AddScene(int count, double near, double far, const Eigen::Matrix3d& R,
                const Eigen::Vector3d& t) {
    while (count > 0) {
      const Eigen::Vector2d a = Anywhere();
      const Eigen::Vector3d ray((a.x() - kWidthPx / 2) / kFocalPx,
                                (a.y() - kHeightPx / 2) / kFocalPx, 1);
      const Eigen::Vector3d moved = R * (Uniform(near, far, &random_) * ray) + t;
      const Eigen::Vector2d b =
          kFocalPx * moved.hnormalized() + Eigen::Vector2d(kWidthPx / 2, kHeightPx / 2);
      if (b.x() < 1 || b.y() < 1 || b.x() > kWidthPx - 1 || b.y() > kHeightPx - 1) continue;
      AddMatch(a, b);
      --count;
    }
  }

  // Within [left, right] x [top, bottom], at the same place of both photos.
  void AddStill(int count, double left, double right, double top, double bottom) {
    for (int i = 0; i < count; ++i) {
      const double x = Uniform(left, right, &random_);
      const Eigen::Vector2d at(x, Uniform(top, bottom, &random_));
      AddMatch(at, at);
    }
  }

  void AddFalse(int count) {
    for (int i = 0; i < count; ++i) AddMatch(Anywhere(), Anywhere());
  }

  // A flat thing of 400 x 300 px, here and moved by H.
  void AddFlat(int count, const Eigen::Matrix3d& H) {
    for (int i = 0; i < count; ++i) {
      const double x = Uniform(500, 900, &random_);
      const Eigen::Vector2d at(x, Uniform(400, 700, &random_));
      AddMatch(at, (H * at.homogeneous()).hnormalized());
    }
  }

  PairEstimate Estimate() const { return EstimateWithoutOverlay(first_, second_, matches_, 7); }
  // Geometry of the pair, as the only one of its photo.
  TwoViewGeometry OfAPhoto() const {
    const PairEstimate pair = Estimate();
    std::vector<PairWithEvidence> pairs = {
        {pair.geometry, StandStill(first_, second_, pair.geometry.inlier_matches), pair.evidence}};
    LeaveOutOverlay(first_.points, &pairs);
    return pairs[0].geometry;
  }
  int NumStill(const TwoViewGeometry& geometry) const {
    const std::vector<char> still = StandStill(first_, second_, geometry.inlier_matches);
    return static_cast<int>(std::count(still.begin(), still.end(), 1));
  }
  TwoViewGeometry EstimateOfAll() const {
    return EstimateTwoView(first_.camera, first_.points, second_.camera, second_.points, matches_,
                           7);
  }
  void ExpectAsOfAll() const {
    const TwoViewGeometry ours = Estimate().geometry, all = EstimateOfAll();
    EXPECT_TRUE(IsVerified(ours));
    EXPECT_EQ(ours.config, all.config);
    EXPECT_EQ(ours.E, all.E);
    EXPECT_EQ(ours.inlier_matches.size(), all.inlier_matches.size());
    EXPECT_EQ(OfAPhoto().inlier_matches.size(), all.inlier_matches.size());
  }

  std::mt19937 random_{3};
  PhotoFeatures first_, second_;
  FeatureMatches matches_;
};

const Eigen::Matrix3d kTurn =
    Eigen::AngleAxisd(0.1, Eigen::Vector3d(0.5, 1, 0.4).normalized()).matrix();
const Eigen::Vector3d kStep(1, 0.1, 0.2);

TEST_F(Overlay, IsLeftOutWhereTheSceneMoves) {
  AddStill(300, 100, 900, 400, 560);
  AddScene(100, 6, 14, kTurn, kStep);
  AddFalse(60);
  EXPECT_GT(NumStill(EstimateOfAll()), 250) << "it would win";
  const PairEstimate pair = Estimate();
  EXPECT_EQ(pair.geometry.config, TwoViewGeometry::CALIBRATED);
  EXPECT_NEAR(std::abs(pair.geometry.tvec.dot(kStep.normalized())), 1, 0.01);
  EXPECT_EQ(NumStill(pair.geometry), 0);
  EXPECT_GE(pair.geometry.inlier_matches.size(), 95u);
  EXPECT_EQ(pair.evidence.overlay.size(), 300u);
}

TEST_F(Overlay, IsNoOverlap) {
  AddStill(300, 100, 900, 400, 560);
  AddFalse(60);
  EXPECT_TRUE(IsVerified(EstimateOfAll())) << "it would be taken for one";
  EXPECT_FALSE(IsVerified(Estimate().geometry));
}

TEST_F(Overlay, IsNoneInABurst) {
  AddStill(900, 0, kWidthPx, 0, kHeightPx);
  AddFalse(60);
  ExpectAsOfAll();
}

// Few matches, as of two exposures.
TEST_F(Overlay, IsNoneInABurstThatMatchesBadly) {
  AddStill(30, 0, kWidthPx, 0, kHeightPx);
  AddFalse(60);
  ExpectAsOfAll();
}

// A car turns before a tripod, or an object that a map could not begin with.
TEST_F(Overlay, IsForOtherPairsToTellWhereMostStandsStill) {
  AddStill(900, 0, kWidthPx, 0, kHeightPx);
  AddScene(60, 6, 14, kTurn, kStep);
  ExpectAsOfAll();
  const OverlayEvidence evidence = Estimate().evidence;
  EXPECT_TRUE(evidence.overlay.empty());
  EXPECT_EQ(evidence.background.size(), 900u);
  ASSERT_TRUE(evidence.of_moving);
  EXPECT_NEAR(std::abs(evidence.of_moving->tvec.dot(kStep.normalized())), 1, 0.01);
}

TEST_F(Overlay, IsTheBackgroundOfATurntableInTwoPhotos) {
  AddStill(900, 0, kWidthPx, 0, kHeightPx);
  AddScene(150, 6, 14, kTurn, kStep);
  const TwoViewGeometry of_object = OfAPhoto();
  EXPECT_EQ(of_object.config, TwoViewGeometry::CALIBRATED);
  EXPECT_EQ(NumStill(of_object), 0);
  EXPECT_GE(of_object.inlier_matches.size(), 140u);
  EXPECT_NEAR(std::abs(of_object.tvec.dot(kStep.normalized())), 1, 0.01);
}

// Its geometry is one of many that explain a plane.
TEST_F(Overlay, IsTheBackgroundOfAFlatThingThatTurns) {
  AddStill(900, 0, kWidthPx, 0, kHeightPx);
  Eigen::Matrix3d H = Eigen::Translation2d(700, 550) * Eigen::Rotation2Dd(0.3) *
                      Eigen::Translation2d(-600, -560) * Eigen::Matrix3d::Identity();
  H.row(2) << 1e-4, -5e-5, 1;
  AddFlat(300, H);
  EXPECT_EQ(Estimate().evidence.background.size(), 900u);
  EXPECT_EQ(NumStill(OfAPhoto()), 0);
}

// A bus drives through the photos of a tripod.
TEST_F(Overlay, IsNoneWhereAFlatThingIsShifted) {
  AddStill(900, 0, kWidthPx, 0, kHeightPx);
  Eigen::Matrix3d H = Eigen::Matrix3d::Identity();
  H.topRightCorner<2, 1>() << 90, 20;
  AddFlat(300, H);
  EXPECT_TRUE(Estimate().evidence.background.empty());
  ExpectAsOfAll();
}

TEST_F(Overlay, IsNoneBeforeACameraThatTurnsOnATripod) {
  AddScene(900, 6, 14, kTurn, Eigen::Vector3d::Zero());
  ExpectAsOfAll();
  EXPECT_EQ(OfAPhoto().config, TwoViewGeometry::PANORAMIC);
}

// Far points move by less than the largest error, by a hand that turns the camera a little.
TEST_F(Overlay, IsNoDistantScene) {
  const Eigen::Matrix3d little = Eigen::AngleAxisd(0.001, Eigen::Vector3d::UnitY()).matrix();
  AddScene(700, 600, 2000, little, kStep);
  AddScene(200, 6, 60, little, kStep);
  EXPECT_GT(NumStill(EstimateOfAll()), 600);
  EXPECT_TRUE(Estimate().evidence.background.empty());
  ExpectAsOfAll();
}

// Mountains above a road, by a camera on a rail.
TEST_F(Overlay, IsNoFarBackground) {
  AddScene(200, 6, 14, Eigen::Matrix3d::Identity(), {1, 0, 0});
  AddStill(150, 0, kWidthPx, 0, 200);
  ExpectAsOfAll();
  EXPECT_GE(Estimate().geometry.inlier_matches.size(), 340u);
  EXPECT_TRUE(Estimate().evidence.overlay.empty());
}

TEST_F(Overlay, IsNoneInPhotosOfDifferentSize) {
  AddStill(300, 100, 900, 400, 560);
  second_.camera = PriorCamera(kWidthPx, kHeightPx + 8, kFocalPx, true);
  ExpectAsOfAll();
}

// Keypoints of a photo on a line, every ten pixels, and its pairs.
class OverlayOfAPhoto : public testing::Test {
 protected:
  OverlayOfAPhoto() {
    for (int i = 0; i < 200; ++i) points_.emplace_back(10 * i, 50);
  }

  // Inliers from `begin` to `end`.
  static PairWithEvidence Pair(uint32_t begin, uint32_t end, bool still) {
    PairWithEvidence pair;
    pair.geometry.config = TwoViewGeometry::CALIBRATED;
    Append(begin, end, still, &pair);
    return pair;
  }
  static void Append(uint32_t begin, uint32_t end, bool still, PairWithEvidence* pair) {
    for (uint32_t i = begin; i < end; ++i) {
      pair->geometry.inlier_matches.emplace_back(i, i);
      pair->stand_still.push_back(still);
    }
  }
  // A still background, keypoints 0 to 100, and an object, 100 to `end`, that turns.
  static PairWithEvidence PairOfATurntable(uint32_t end = 140) {
    PairWithEvidence pair = Pair(0, 100, true);
    for (uint32_t i = 0; i < 100; ++i) pair.evidence.background.push_back(i);
    pair.evidence.of_moving = Pair(100, end, false).geometry;
    return pair;
  }

  void LeaveOut() { LeaveOutOverlay(points_, &pairs_); }
  size_t NumInliers(size_t pair) const { return pairs_[pair].geometry.inlier_matches.size(); }

  std::vector<Eigen::Vector2d> points_;
  std::vector<PairWithEvidence> pairs_;
};

TEST_F(OverlayOfAPhoto, IsLeftOutWhereOnePairDoesNotTell) {
  pairs_ = {Pair(100, 150, false), Pair(100, 150, false), Pair(0, 40, true)};
  for (uint32_t i = 0; i < 30; ++i) pairs_[0].evidence.overlay.push_back(i);
  Append(0, 40, true, &pairs_[1]);
  LeaveOut();
  EXPECT_EQ(NumInliers(0), 50u);
  EXPECT_EQ(NumInliers(1), 60u) << "30 to 40 were seen nowhere else";
  EXPECT_FALSE(IsVerified(pairs_[2].geometry)) << "10 inliers are too few";
}

TEST_F(OverlayOfAPhoto, LeavesWhatMovesAtTheSamePlace) {
  pairs_ = {Pair(100, 150, false), Pair(0, 40, false)};
  for (uint32_t i = 0; i < 30; ++i) pairs_[0].evidence.overlay.push_back(i);
  LeaveOut();
  EXPECT_EQ(NumInliers(1), 40u);
}

TEST_F(OverlayOfAPhoto, IsABackgroundOfThreePairs) {
  pairs_ = {PairOfATurntable(), PairOfATurntable(), Pair(0, 90, true)};
  LeaveOut();
  EXPECT_EQ(NumInliers(0), 100u) << "two pairs may be of a tripod and a car";
  pairs_ = {PairOfATurntable(), PairOfATurntable(), PairOfATurntable(), Pair(0, 90, true)};
  LeaveOut();
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(NumInliers(i), 40u);
    EXPECT_TRUE(IsVerified(pairs_[i].geometry));
  }
  EXPECT_FALSE(IsVerified(pairs_[3].geometry));
}

TEST_F(OverlayOfAPhoto, IsABackgroundOfOnePairThatAMapCouldBeginWith) {
  pairs_ = {PairOfATurntable(199), Pair(0, 90, true)};
  LeaveOut();
  EXPECT_EQ(NumInliers(0), 100u);
  pairs_ = {PairOfATurntable(200), Pair(0, 90, true)};
  LeaveOut();
  EXPECT_EQ(pairs_[0].geometry.inlier_matches.front().point2D_idx1, 100u);
  EXPECT_FALSE(IsVerified(pairs_[1].geometry));
}

TEST_F(OverlayOfAPhoto, IsABackgroundWhereMostOfWhatStandsStillWasSeenElsewhere) {
  pairs_ = {PairOfATurntable(200), Pair(60, 130, true), Pair(80, 130, true)};
  pairs_[1].evidence.of_moving = Pair(130, 150, false).geometry;
  LeaveOut();
  EXPECT_EQ(NumInliers(1), 20u);
  EXPECT_EQ(NumInliers(2), 30u);
}

TEST_F(OverlayOfAPhoto, IsNoBackgroundThatMovesInAnotherPair) {
  pairs_ = {PairOfATurntable(), PairOfATurntable(), PairOfATurntable(), Pair(20, 60, false)};
  LeaveOut();
  EXPECT_EQ(NumInliers(0), 100u);
  EXPECT_EQ(NumInliers(3), 40u);
}

}  // namespace skein::overlay_test
