#include "geometry/rotation_averaging.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

namespace skein::rotation_averaging_test {

constexpr double kMaxErrorDeg = 10;

Eigen::Matrix3d RandomRotation(std::mt19937* random) {
  std::normal_distribution<double> normal;
  Eigen::Quaterniond q(normal(*random), normal(*random), normal(*random), normal(*random));
  return q.normalized().toRotationMatrix();
}

Eigen::Matrix3d Disturbed(const Eigen::Matrix3d& R, double sigma_deg, std::mt19937* random) {
  std::normal_distribution<double> normal(0, sigma_deg * M_PI / 180);
  const Eigen::Vector3d w(normal(*random), normal(*random), normal(*random));
  return Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix() * R;
}

// Photos 1 to n of random rotations; pairs of those that are at most `reach` apart.
struct Graph {
  Graph(int n, int reach, double sigma_deg) {
    for (int i = 0; i < n; ++i) truth.push_back(RandomRotation(&random));
    for (int i = 0; i < n; ++i) {
      for (int j = i + 1; j < n && j <= i + reach; ++j) {
        const Eigen::Matrix3d R = truth[j] * truth[i].transpose();
        pairs.push_back({uint32_t(i + 1), uint32_t(j + 1), Disturbed(R, sigma_deg, &random), 100});
      }
    }
  }

  // Largest error of a relative rotation between two photos, degrees.
  double LargestErrorDeg(const RotationAveraging& found) const {
    double largest = 0;
    for (const auto& [id1, R1] : found.rotations) {
      for (const auto& [id2, R2] : found.rotations) {
        const Eigen::Matrix3d error =
            R2 * R1.transpose() * truth[id1 - 1] * truth[id2 - 1].transpose();
        largest = std::max(largest, Eigen::AngleAxisd(error).angle() * 180 / M_PI);
      }
    }
    return largest;
  }

  std::mt19937 random{1};
  std::vector<Eigen::Matrix3d> truth;
  std::vector<RelativeRotation> pairs;
};

TEST(AverageRotations, FindsThoseOfExactPairs) {
  const Graph graph(20, 3, 0);
  const RotationAveraging found = AverageRotations(graph.pairs, kMaxErrorDeg);
  EXPECT_EQ(found.rotations.size(), 20u);
  EXPECT_LT(graph.LargestErrorDeg(found), 0.01);
}

TEST(AverageRotations, SpreadsTheErrorsOfNoisyPairs) {
  const Graph graph(20, 5, 1);
  const RotationAveraging found = AverageRotations(graph.pairs, kMaxErrorDeg);
  EXPECT_EQ(found.rotations.size(), 20u);
  EXPECT_LT(graph.LargestErrorDeg(found), 4);
}

// A wrong pair of most inliers stands in the spanning tree.
TEST(AverageRotations, OutvotesWrongPairs) {
  Graph graph(20, 5, 0.5);
  std::vector<size_t> wrong;
  for (size_t i = 3; i < graph.pairs.size(); i += 8) {
    graph.pairs[i].R = RandomRotation(&graph.random);
    graph.pairs[i].weight = 300;
    wrong.push_back(i);
  }
  const RotationAveraging found = AverageRotations(graph.pairs, kMaxErrorDeg);
  EXPECT_EQ(found.rotations.size(), 20u);
  EXPECT_LT(graph.LargestErrorDeg(found), 3);
  for (size_t i = 0; i < graph.pairs.size(); ++i) {
    const bool is_wrong = std::count(wrong.begin(), wrong.end(), i) > 0;
    EXPECT_EQ(found.fits[i], !is_wrong) << i;
  }
}

// Photos around an object with equal sides: pairs of different sides are more, and agree with each
// other, but have fewer matches.
TEST(AverageRotations, CountsMatchesNotPairs) {
  Graph graph(24, 4, 0.5);
  for (RelativeRotation& pair : graph.pairs) pair.weight = 200;
  const size_t num_true = graph.pairs.size();
  std::vector<Eigen::Matrix3d> folded;
  for (int i = 0; i < 24; ++i) folded.push_back(RandomRotation(&graph.random));
  for (int i = 0; i < 24; ++i) {
    for (int j = i + 5; j < 24; ++j) {
      const Eigen::Matrix3d R = folded[j] * folded[i].transpose();
      graph.pairs.push_back({uint32_t(i + 1), uint32_t(j + 1), R, 60});
    }
  }
  ASSERT_GT(graph.pairs.size(), 2 * num_true);
  const RotationAveraging found = AverageRotations(graph.pairs, kMaxErrorDeg);
  EXPECT_EQ(found.rotations.size(), 24u);
  EXPECT_LT(graph.LargestErrorDeg(found), 4);
}

TEST(AverageRotations, KeepsTheLargestComponent) {
  Graph graph(10, 3, 0);
  graph.pairs.push_back({100, 101, Eigen::Matrix3d::Identity(), 1000});
  const RotationAveraging found = AverageRotations(graph.pairs, kMaxErrorDeg);
  EXPECT_EQ(found.rotations.size(), 10u);
  EXPECT_EQ(found.rotations.count(100), 0u);
  EXPECT_FALSE(found.fits.back());
}

TEST(AverageRotations, OfNothingIsNothing) {
  EXPECT_TRUE(AverageRotations({}, kMaxErrorDeg).rotations.empty());
}

}  // namespace skein::rotation_averaging_test
