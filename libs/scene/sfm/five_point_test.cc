#include "sfm/five_point.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "sfm/colmap_api.h"
#include "testing/test_random.h"

namespace skein::five_point_test {

using Points = std::vector<Eigen::Vector2d>;

struct FivePoints {
  Points first, second;
  Eigen::Matrix3d E;
};

// Of a random motion, seen by both cameras.
FivePoints Photographed(std::mt19937* random, const Eigen::Vector3d& translation) {
  FivePoints points;
  const Eigen::Vector3d axis(Uniform(-1, 1, random), Uniform(-1, 1, random),
                             Uniform(-1, 1, random));
  const Eigen::Matrix3d R =
      Eigen::AngleAxisd(Uniform(0.05, 0.5, random), axis.normalized()).matrix();
  for (int i = 0; i < 5; ++i) {
    const double x = Uniform(-2, 2, random), y = Uniform(-2, 2, random);
    const Eigen::Vector3d point(x, y, Uniform(4, 9, random));
    points.first.push_back(point.hnormalized());
    points.second.push_back((R * point + translation).hnormalized());
  }
  Eigen::Matrix3d cross;
  const Eigen::Vector3d& t = translation;
  cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  points.E = (cross * R).normalized();
  return points;
}

double Distance(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return std::min((a - b).norm(), (a + b).norm());
}

double NearestDistance(const std::vector<Eigen::Matrix3d>& models, const Eigen::Matrix3d& E) {
  double nearest = 2;
  for (const Eigen::Matrix3d& model : models) nearest = std::min(nearest, Distance(model, E));
  return nearest;
}

TEST(FivePoint, TheTrueMatrixIsAmongThem) {
  std::mt19937 random(1);
  int num_exact = 0;
  for (int i = 0; i < 500; ++i) {
    const FivePoints points =
        Photographed(&random, Eigen::Vector3d(1, Uniform(-1, 1, &random), 0.3));
    const auto models = FivePointEstimator::Estimate(points.first, points.second);
    EXPECT_LE(models.size(), 10u);
    num_exact += NearestDistance(models, points.E) < 1e-6;
  }
  EXPECT_GE(num_exact, 495);  // some configurations are near to a double root
}

TEST(FivePoint, EachIsAnEssentialMatrixOfThesePoints) {
  std::mt19937 random(2);
  int num_models = 0, num_exact = 0;
  for (int i = 0; i < 100; ++i) {
    const FivePoints points = Photographed(&random, Eigen::Vector3d(0.2, 0.1, -1));
    for (const Eigen::Matrix3d& E : FivePointEstimator::Estimate(points.first, points.second)) {
      EXPECT_NEAR(E.norm(), 1, 1e-12);
      const Eigen::Matrix3d EEt = E * E.transpose();
      const double error = (2 * EEt * E - EEt.trace() * E).norm() + std::abs(E.determinant());
      EXPECT_LT(error, 1e-3);
      num_exact += error < 1e-6;
      ++num_models;
      for (int k = 0; k < 5; ++k) {
        EXPECT_NEAR(points.second[k].homogeneous().dot(E * points.first[k].homogeneous()), 0, 1e-9);
      }
    }
  }
  EXPECT_GE(num_exact, 0.98 * num_models);
}

TEST(FivePoint, FindsWhatColmapFinds) {
  std::mt19937 random(3);
  size_t num_theirs = 0, num_found = 0;
  for (int i = 0; i < 300; ++i) {
    FivePoints points = Photographed(&random, Eigen::Vector3d(1, 0, 0));
    for (auto& point : points.second) point += Eigen::Vector2d(Uniform(-0.3, 0.3, &random), 0);
    const auto ours = FivePointEstimator::Estimate(points.first, points.second);
    for (const Eigen::Matrix3d& E : colmap_api::Models<colmap::EssentialMatrixFivePointEstimator>(
             points.first, points.second)) {
      ++num_theirs;
      num_found += NearestDistance(ours, E) < 1e-4;
    }
  }
  EXPECT_GT(num_theirs, 600u);
  EXPECT_GE(num_found, 0.995 * num_theirs);
}

TEST(FivePoint, RefusesDegeneratePoints) {
  for (const Eigen::Matrix3d& E :
       FivePointEstimator::Estimate(Points(5, {0.1, 0.2}), Points(5, {0.1, 0.2}))) {
    EXPECT_TRUE(E.allFinite());
  }
  EXPECT_THROW(FivePointEstimator::Estimate(Points(6, {0, 0}), Points(6, {0, 0})),
               std::invalid_argument);
}

// Coefficients of the product of factors, each lowest power first.
std::array<double, 11> Product(const std::vector<std::vector<double>>& factors) {
  std::array<double, 11> product{1};
  for (const std::vector<double>& factor : factors) {
    std::array<double, 11> next{};
    for (size_t i = 0; i < product.size(); ++i) {
      for (size_t j = 0; j < factor.size() && i + j < next.size(); ++j) {
        next[i + j] += product[i] * factor[j];
      }
    }
    product = next;
  }
  return product;
}

std::vector<double> SortedRoots(const std::array<double, 11>& coefficients) {
  std::vector<double> roots = RealRoots(coefficients);
  std::sort(roots.begin(), roots.end());
  return roots;
}

// Beside six complex ones.
TEST(RealRoots, AreFoundWithinAndBeyondOne) {
  const auto roots = SortedRoots(
      Product({{-0.5, 1}, {2, 1}, {-30, 1}, {0.99, 1}, {2, -2, 1}, {5, -2, 1}, {10, -2, 1}}));
  ASSERT_EQ(roots.size(), 4u);
  EXPECT_NEAR(roots[0], -2, 1e-9);
  EXPECT_NEAR(roots[1], -0.99, 1e-9);
  EXPECT_NEAR(roots[2], 0.5, 1e-9);
  EXPECT_NEAR(roots[3], 30, 1e-7);
}

TEST(RealRoots, TellsNearRootsFromNearlyRealOnes) {
  constexpr double kNear = 1e-4;
  const std::vector<double> rest{3, 0, 1, 0, 3, 0, 1};  // without real roots
  const auto roots = SortedRoots(Product({{-0.3, 1}, {-0.3 - kNear, 1}, {7, 0, 1}, rest}));
  ASSERT_EQ(roots.size(), 2u);
  EXPECT_NEAR(roots[0], 0.3, 1e-9);
  EXPECT_NEAR(roots[1], 0.3 + kNear, 1e-9);
  EXPECT_TRUE(SortedRoots(Product({{0.09 + kNear * kNear, -0.6, 1}, {7, 0, 1}, rest})).empty());
}

TEST(RealRoots, WhereThePiecesMeetAreFoundOnce) {
  const auto roots =
      SortedRoots(Product({{0, 1}, {-0.5, 1}, {0.25, 1}, {1, 0, 1}, {2, 0, 1}, {3, 0, 1}, {4, 1}}));
  ASSERT_EQ(roots.size(), 4u);
  EXPECT_NEAR(roots[0], -4, 1e-9);
  EXPECT_NEAR(roots[1], -0.25, 1e-12);
  EXPECT_NEAR(roots[2], 0, 1e-12);
  EXPECT_NEAR(roots[3], 0.5, 1e-12);
}

TEST(RealRoots, OfNothingAreNone) { EXPECT_TRUE(RealRoots({}).empty()); }

}  // namespace skein::five_point_test
