#include "matching/guided.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <random>

#include "testing/test_random.h"

namespace skein {
namespace {

constexpr double kWidthPx = 1600, kHeightPx = 1200, kFocalPx = 1300;

Eigen::Matrix3d Cross(const Eigen::Vector3d& t) {
  Eigen::Matrix3d cross;
  cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  return cross;
}

// Of two cameras with the principal point in the middle; camera 2 from camera 1.
Eigen::Matrix3d FundamentalOf(const Eigen::Vector3d& t, double angle_rad) {
  Eigen::Matrix3d K;
  K << kFocalPx, 0, kWidthPx / 2, 0, kFocalPx, kHeightPx / 2, 0, 0, 1;
  const Eigen::Matrix3d R =
      Eigen::AngleAxisd(angle_rad, Eigen::Vector3d(0.2, 1, 0.1).normalized()).matrix();
  return K.inverse().transpose() * Cross(t) * R * K.inverse();
}

struct Geometry {
  const char* name;
  Eigen::Vector3d t;
  double angle_rad;
};

// Epipoles at infinity along x and y, far away, at the border and in the middle of the photo.
const Geometry kGeometries[] = {{"along x", {1, 0, 0}, 0},
                                {"along y", {0, 1, 0}, 0},
                                {"far", {1, 0.2, 0.05}, 0.1},
                                {"turned", {-1, 0.1, 0.4}, 0.5},
                                {"border", {0.6, 0.1, 1}, 0.05},
                                {"forward", {0, 0, 1}, 0},
                                {"forward, turned", {0.1, 0, 1}, 0.2}};

double SampsonSq(const Eigen::Matrix3d& F, const Eigen::Vector2d& x1, const Eigen::Vector2d& x2) {
  const Eigen::Vector3d line2 = F * x1.homogeneous(), line1 = F.transpose() * x2.homogeneous();
  const double c = x2.homogeneous().dot(line2);
  return c * c / (line2.head<2>().squaredNorm() + line1.head<2>().squaredNorm());
}

class Guided : public testing::Test {
 protected:
  std::vector<Eigen::Vector2d> RandomPoints(size_t count) {
    std::vector<Eigen::Vector2d> points;
    for (size_t i = 0; i < count; ++i) {
      const double x = Uniform(0, kWidthPx, &random_);
      points.emplace_back(x, Uniform(0, kHeightPx, &random_));
    }
    return points;
  }

  PhotoFeatures RandomPhoto(size_t count) {
    PhotoFeatures photo;
    photo.points = RandomPoints(count);
    for (size_t i = 0; i < count * kDescriptorDim; ++i) {
      photo.descriptors.push_back(random_() % 64);
    }
    photo.index = MakeFeatureIndex(photo.points, std::vector<float>(count, 1), photo.descriptors);
    return photo;
  }

  std::mt19937 random_{11};
};

// At the very border of the band rounding to float decides.
TEST_F(Guided, FanFindsWhatIsNearTheLineAndNothingElse) {
  constexpr double kMaxErrorPx = 3, kRoundingPx = 0.01;
  const auto points1 = RandomPoints(150), points2 = RandomPoints(3000);
  for (const Geometry& geometry : kGeometries) {
    const Eigen::Matrix3d F = FundamentalOf(geometry.t, geometry.angle_rad);
    EpipolarFan fan;
    fan.Build(points2, F);
    size_t num_found = 0;
    for (const auto& point : points1) {
      std::vector<uint32_t> found;
      fan.Find(point, kMaxErrorPx, &found);
      for (uint32_t& place : found) place = fan.features()[place];
      std::sort(found.begin(), found.end());
      EXPECT_EQ(std::adjacent_find(found.begin(), found.end()), found.end()) << geometry.name;
      num_found += found.size();
      for (uint32_t j = 0; j < points2.size(); ++j) {
        const double error_px = std::sqrt(SampsonSq(F, point, points2[j]));
        if (std::abs(error_px - kMaxErrorPx) < kRoundingPx) continue;
        ASSERT_EQ(std::binary_search(found.begin(), found.end(), j), error_px < kMaxErrorPx)
            << geometry.name << ", error " << error_px;
      }
    }
    EXPECT_GT(num_found, points1.size()) << geometry.name;
  }
}

// By the rules in guided.h, from all pairs.
std::vector<IndexPair> Reference(const PhotoFeatures& a, const PhotoFeatures& b,
                                 const Eigen::Matrix3d& F, const GuidedOptions& options) {
  struct Best {
    int64_t best = std::numeric_limits<int32_t>::max(), second = best;
    size_t index = 0;
  };
  std::vector<Best> rows(a.points.size()), columns(b.points.size());
  const auto insert = [](int64_t distance, size_t index, Best* best) {
    if (distance < best->best) {
      *best = {distance, best->best, index};
    } else {
      best->second = std::min(best->second, distance);
    }
  };
  for (size_t i = 0; i < rows.size(); ++i) {
    for (size_t j = 0; j < columns.size(); ++j) {
      const double max_error = options.max_error_px * options.max_error_px;
      if (SampsonSq(F, a.points[i], b.points[j]) > max_error) continue;
      int64_t distance = 0;
      for (int k = 0; k < kDescriptorDim; ++k) {
        const int d = a.descriptors[i * kDescriptorDim + k] - b.descriptors[j * kDescriptorDim + k];
        distance += d * d;
      }
      insert(distance, j, &rows[i]);
      insert(distance, i, &columns[j]);
    }
  }
  const auto passes = [&](const Best& best) {
    return best.best <= options.max_distance_sq &&
           best.best < options.max_ratio * options.max_ratio * best.second;
  };
  std::vector<IndexPair> matches;
  for (size_t i = 0; i < rows.size(); ++i) {
    if (!passes(rows[i]) || !passes(columns[rows[i].index])) continue;
    if (columns[rows[i].index].index != i) continue;
    matches.push_back({static_cast<uint32_t>(i), static_cast<uint32_t>(rows[i].index)});
  }
  return matches;
}

TEST_F(Guided, EqualsReferenceWithEachKernel) {
  const PhotoFeatures a = RandomPhoto(700);
  PhotoFeatures b = RandomPhoto(600);
  // Half of b's descriptors are a's, slightly changed; the others are random.
  for (size_t i = 0; i < 300 * kDescriptorDim; ++i)
    b.descriptors[i] = a.descriptors[i] ^ (i % 7 == 0);
  const Eigen::Matrix3d F = FundamentalOf({1, 0.2, 0.05}, 0.1);
  for (size_t i = 0; i < 200; ++i) {  // these agree with F, the other 100 do not
    Eigen::Vector3d line = F * a.points[i].homogeneous();
    line /= line.head<2>().norm();
    b.points[i] -= line.dot(b.points[i].homogeneous()) * line.head<2>();
  }
  b.index = MakeFeatureIndex(b.points, std::vector<float>(600, 1), b.descriptors);
  GuidedOptions options;
  const auto expected = Reference(a, b, F, options);
  EXPECT_GE(expected.size(), 180u);
  EXPECT_LE(expected.size(), 260u);
  for (const KernelVersion kernel : kKernelVersions) {
    if (!IsKernelSupported(kernel)) continue;
    options.kernel = kernel;
    EXPECT_EQ(GuidedMatcher(options).Match(a, b, F), expected) << KernelName(kernel);
    EXPECT_EQ(GuidedMatcher(options).Match(a, b, -1e-9 * F), expected) << "of another scale";
  }
}

TEST_F(Guided, FindsNothingByAMatrixThatIsNone) {
  const PhotoFeatures a = RandomPhoto(50);
  GuidedMatcher matcher{GuidedOptions()};
  EXPECT_TRUE(matcher.Match(a, a, Eigen::Matrix3d::Zero()).empty());
  EXPECT_TRUE(matcher.Match(a, a, Eigen::Matrix3d::Constant(std::nan(""))).empty());
  EXPECT_TRUE(matcher.Match(a, RandomPhoto(0), FundamentalOf({1, 0, 0}, 0)).empty());
  EXPECT_TRUE(matcher.Match(RandomPhoto(0), a, FundamentalOf({1, 0, 0}, 0)).empty());
}

}  // namespace
}  // namespace skein
