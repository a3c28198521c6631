#include "matching/pair_matcher.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "testing/test_random.h"

namespace skein::pair_matcher_test {

constexpr int kWidthPx = 1600, kHeightPx = 1200;
constexpr double kFocalPx = 1300;
constexpr size_t kNumFeatures = 5000;

// Features are ordered by falling scale. Feature i of two photos is of one point where both have it
// in common, else of clutter. A common point has a descriptor of its own.
class Cascade : public testing::Test {
 protected:
  void SetUp() override {
    for (size_t i = 0; i < kNumFeatures; ++i) {
      const double x = Uniform(-4, 4, &random_), y = Uniform(-3, 3, &random_);
      points_.emplace_back(x, y, Uniform(6, 14, &random_));
      for (int k = 0; k < kDescriptorDim; ++k) descriptors_.push_back(random_() % 32);
    }
  }

  using IsCommon = std::function<bool(size_t)>;

  // From (x, 0, 0) along z.
  PhotoFeatures Photo(int64_t id, double x, const IsCommon& is_common) {
    PhotoFeatures photo;
    photo.image_id = id;
    photo.camera = PriorCamera(kWidthPx, kHeightPx, kFocalPx, true);
    photo.descriptors = descriptors_;
    std::vector<float> scales_px;
    for (size_t i = 0; i < kNumFeatures; ++i) {
      const Eigen::Vector3d& point = points_[i];
      photo.points.emplace_back(
          std::clamp(kFocalPx * (point.x() - x) / point.z() + kWidthPx / 2, 0.0, 1.0 * kWidthPx),
          std::clamp(kFocalPx * point.y() / point.z() + kHeightPx / 2, 0.0, 1.0 * kHeightPx));
      scales_px.push_back(static_cast<float>(kNumFeatures - i));
      if (is_common(i)) continue;
      for (int k = 0; k < kDescriptorDim; ++k) {
        photo.descriptors[i * kDescriptorDim + k] = random_() % 32;
      }
    }
    photo.index = MakeFeatureIndex(photo.points, scales_px, photo.descriptors, &cells_);
    return photo;
  }

  // Feature i of `b` as from (x, y, 0), if that of `a` is from the origin.
  void Move(double x, double y, size_t i, const PhotoFeatures& a, PhotoFeatures* b) const {
    b->points[i] = a.points[i] - Eigen::Vector2d(x, y) * kFocalPx / points_[i].z();
  }

  // Around random descriptors.
  static Codebook CodebookOfCells(int num_cells) {
    std::mt19937 random(7);
    Codebook codebook;
    codebook.mean = Eigen::VectorXf::Zero(kDescriptorDim);
    codebook.projection = Codebook::Matrix::Identity(kDescriptorDim, kDescriptorDim);
    codebook.centres.resize(num_cells, kDescriptorDim);
    for (float& value : codebook.centres.reshaped()) value = random() % 64;
    codebook.centres.rowwise().normalize();
    return codebook;
  }

  static IsCommon None() {
    return [](size_t) { return false; };
  }
  static IsCommon Each(size_t step) {
    return [step](size_t i) { return i % step == 0; };
  }

  static PairResult Match(const PhotoFeatures& a, const PhotoFeatures& b, bool cascade) {
    return PairMatcher(cascade).Match(a, b);
  }

  static void ExpectAsInFull(const PhotoFeatures& a, const PhotoFeatures& b) {
    const PairResult ours = Match(a, b, true), full = Match(a, b, false);
    EXPECT_EQ(ours.geometry.config, full.geometry.config);
    EXPECT_EQ(ours.geometry.E, full.geometry.E);
    ASSERT_EQ(ours.geometry.inlier_matches.size(), full.geometry.inlier_matches.size());
    for (size_t i = 0; i < full.geometry.inlier_matches.size(); ++i) {
      EXPECT_EQ(ours.geometry.inlier_matches[i].point2D_idx1,
                full.geometry.inlier_matches[i].point2D_idx1);
    }
  }

  const DescriptorCells cells_{CodebookOfCells(24)};
  std::mt19937 random_{5};
  std::vector<Eigen::Vector3d> points_;
  std::vector<uint8_t> descriptors_;
};

TEST_F(Cascade, MatchesAnOverlappingPairWithoutTheFullProduct) {
  const PhotoFeatures a = Photo(2, 0, Each(2)), b = Photo(1, 0.5, Each(2));
  const PairResult result = Match(a, b, true);
  EXPECT_EQ(result.geometry.config, TwoViewGeometry::CALIBRATED);
  EXPECT_TRUE(result.by_close_cells);
  EXPECT_GE(result.geometry.inlier_matches.size(),
            0.97 * Match(a, b, false).geometry.inlier_matches.size());
  size_t num_false = 0;
  for (const auto& match : result.geometry.inlier_matches) {
    num_false += match.point2D_idx1 != match.point2D_idx2;
  }
  EXPECT_LE(num_false, result.geometry.inlier_matches.size() / 100);
  EXPECT_NEAR(std::abs(result.geometry.tvec[0]), 1, 1e-4);
}

TEST_F(Cascade, FindsNoOverlapWhereThereIsNone) {
  const PairResult result = Match(Photo(2, 0, None()), Photo(1, 0.5, None()), true);
  EXPECT_FALSE(IsVerified(result.geometry));
  EXPECT_FALSE(result.by_close_cells);
}

// Six of the 1,024 coarsest are common, too few for a geometry, and a hundred of the others.
TEST_F(Cascade, MatchesAllFeaturesWhereTheCoarsestLeaveItUndecided) {
  const IsCommon is_common = [](size_t i) { return i % 200 == 0 || (i > 4000 && i % 10 == 0); };
  const PhotoFeatures a = Photo(2, 0, is_common), b = Photo(1, 0.5, is_common);
  ExpectAsInFull(a, b);
  const PairResult result = Match(a, b, true);
  EXPECT_TRUE(IsVerified(result.geometry));
  EXPECT_FALSE(result.by_close_cells);
  EXPECT_GE(result.geometry.inlier_matches.size(), 100u);
}

// 51 of 250 common features are among the coarsest.
TEST_F(Cascade, TheCoarsestDoNotDecideOnTheGeometry) {
  const PhotoFeatures a = Photo(2, 0, Each(20));
  PhotoFeatures b = Photo(1, 0.5, Each(20));
  for (size_t i = 0; i < kMaxCoarse; i += 20) Move(0, 0.5, i, a, &b);
  const PairResult result = Match(a, b, true);
  EXPECT_TRUE(result.by_close_cells);
  EXPECT_GE(result.geometry.inlier_matches.size(), 190u);
  EXPECT_NEAR(std::abs(result.geometry.tvec[0]), 1, 1e-2);
  ExpectAsInFull(a, b);
}

TEST_F(Cascade, MatchesByNearCellsWhereFewerThanHalfAgree) {
  const PhotoFeatures a = Photo(2, 0, Each(20));
  PhotoFeatures b = Photo(1, 0.5, Each(20));
  for (size_t i = 0; i < kNumFeatures; i += 20) {
    if (i < kMaxCoarse) {
      Move(0, 0.5, i, a, &b);
    } else if (i % 40 == 0) {
      Move(-0.5, 0.5, i, a, &b);
    }
  }
  EXPECT_FALSE(Match(a, b, true).by_close_cells);
  EXPECT_TRUE(IsVerified(Match(a, b, true).geometry));
  ExpectAsInFull(a, b);
}

// Every other feature looks like three others of its photo, which lie on other epipolar lines.
TEST_F(Cascade, TakesNoMatchThatTheFullProductRefusesAsAmbiguous) {
  for (size_t i = 1; i < kNumFeatures; i += 2) {
    const auto alike = descriptors_.begin() + (i / 8 * 8 + 1) * kDescriptorDim;
    std::copy(alike, alike + kDescriptorDim, descriptors_.begin() + i * kDescriptorDim);
  }
  const PhotoFeatures a = Photo(2, 0, Each(1)), b = Photo(1, 0.5, Each(1));
  const PairResult result = Match(a, b, true);
  EXPECT_TRUE(result.by_close_cells);
  EXPECT_GE(result.geometry.inlier_matches.size(), 1500u);
  for (const auto& match : result.geometry.inlier_matches) EXPECT_EQ(match.point2D_idx1 % 2, 0u);
}

TEST_F(Cascade, MatchesInFullPhotosWithoutCellsOrWithFewFeatures) {
  PhotoFeatures a = Photo(2, 0, Each(1)), b = Photo(1, 0.5, Each(1));
  a.index = FeatureIndex();
  ExpectAsInFull(a, b);
  EXPECT_EQ(Match(a, b, true).by_close_cells, false);
  for (PhotoFeatures* photo : {&a, &b}) {
    photo->points.resize(900);
    photo->descriptors.resize(900 * kDescriptorDim);
    photo->index =
        MakeFeatureIndex(photo->points, std::vector<float>(900, 1), photo->descriptors, &cells_);
  }
  EXPECT_EQ(Match(a, b, true).by_close_cells, false);
  EXPECT_TRUE(IsVerified(Match(a, b, true).geometry));
}

TEST_F(Cascade, IsDeterministic) {
  const PhotoFeatures a = Photo(2, 0, Each(3)), b = Photo(1, 0.5, Each(3));
  const PairResult one = Match(a, b, true), two = Match(a, b, true);
  EXPECT_EQ(one.geometry.E, two.geometry.E);
  EXPECT_EQ(one.geometry.inlier_matches.size(), two.geometry.inlier_matches.size());
}

}  // namespace skein::pair_matcher_test
