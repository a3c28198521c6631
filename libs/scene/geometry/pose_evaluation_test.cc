#include "geometry/pose_evaluation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "testing/test_random.h"

namespace skein::pose_evaluation_test {

constexpr unsigned kSeed = 7;

CameraPose PoseAt(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& center) {
  return {rotation, -(rotation * center)};
}

ModelPoses RandomModel(int images, unsigned seed) {
  std::mt19937 random(seed);
  ModelPoses model;
  for (int i = 0; i < images; ++i) {
    const Eigen::Quaterniond rotation(Eigen::AngleAxisd(0.3 * i, Normal3(1, &random).normalized()));
    model.poses.push_back(
        {"agent/" + std::to_string(i) + ".jpg", PoseAt(rotation, Normal3(10, &random))});
  }
  return model;
}

ModelPoses OnALine(int images) {
  ModelPoses model = RandomModel(images, kSeed);
  for (int i = 0; i < images; ++i) {
    CameraPose& pose = model.poses[i].pose;
    pose = PoseAt(pose.rotation, Eigen::Vector3d(0.5 * i, 2, 3));
  }
  return model;
}

Similarity AnySimilarity() {
  Similarity similarity;
  similarity.scale = 0.037;
  similarity.rotation = Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized());
  similarity.translation = Eigen::Vector3d(100, -20, 7);
  return similarity;
}

ModelPoses Moved(ModelPoses model, const Similarity& similarity) {
  for (NamedPose& named : model.poses) named.pose = TransformPose(similarity, named.pose);
  return model;
}

TEST(PoseEvaluation, ExactSimilarityLeavesNoError) {
  const ModelPoses truth = RandomModel(12, kSeed);
  const auto result = EvaluatePoses(Moved(truth, AnySimilarity()), truth);
  ASSERT_TRUE(result.ok()) << result.error();
  EXPECT_EQ(result->registered, 12u);
  EXPECT_EQ(result->total, 12u);
  EXPECT_NEAR(result->truth_from_estimate.scale, 1 / 0.037, 1e-9);
  EXPECT_LT(result->position.max, 1e-9);
  EXPECT_LT(result->rotation_deg.max, 1e-6);
  EXPECT_NEAR(result->auc_1deg, 1, 1e-6);
}

TEST(PoseEvaluation, CentresOnALineAlignByOrientation) {
  const ModelPoses truth = OnALine(8);
  const auto result = EvaluatePoses(Moved(truth, AnySimilarity()), truth);
  ASSERT_TRUE(result.ok()) << result.error();
  EXPECT_TRUE(result->aligned_by_orientation);
  EXPECT_LT(result->position.max, 1e-9);
  EXPECT_LT(result->rotation_deg.max, 1e-6);
}

TEST(PoseEvaluation, CentresInOneSpotAreAnError) {
  ModelPoses truth = OnALine(5);
  for (NamedPose& named : truth.poses) {
    named.pose = PoseAt(named.pose.rotation, Eigen::Vector3d(1, 2, 3));
  }
  EXPECT_FALSE(EvaluatePoses(truth, truth).ok());
}

TEST(PoseEvaluation, TwoCommonPhotosAreAnError) {
  EXPECT_FALSE(EvaluatePoses(RandomModel(2, kSeed), RandomModel(2, kSeed)).ok());
}

TEST(PoseEvaluation, MissingPhotosCountAsFailuresInAuc) {
  const ModelPoses truth = RandomModel(10, kSeed);
  ModelPoses half = truth;
  half.poses.resize(5);
  const auto result = EvaluatePoses(half, truth);
  ASSERT_TRUE(result.ok()) << result.error();
  EXPECT_EQ(result->registered, 5u);
  EXPECT_NEAR(result->auc_5deg, 10.0 / 45.0, 1e-6);
}

TEST(PoseEvaluation, RotationOffsetOfEveryCameraIsReported) {
  const ModelPoses truth = RandomModel(10, kSeed);
  ModelPoses turned = truth;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.5 * M_PI / 180, Eigen::Vector3d::UnitY()));
  for (NamedPose& named : turned.poses) {
    named.pose = PoseAt(turn * named.pose.rotation, named.pose.Centre());
  }
  const auto result = EvaluatePoses(turned, truth);
  ASSERT_TRUE(result.ok()) << result.error();
  EXPECT_NEAR(result->rotation_deg.mean, 0.5, 1e-6);
  EXPECT_LT(result->position.max, 1e-9);
}

TEST(PoseEvaluation, ExtentIsTheLargestDistanceOfTrueCentres) {
  const auto result = EvaluatePoses(OnALine(9), OnALine(9));
  ASSERT_TRUE(result.ok()) << result.error();
  EXPECT_NEAR(result->extent, 4, 1e-12);
}

TEST(MatchPoses, UsesFileNamesOnlyWhereUnique) {
  ModelPoses estimate, truth;
  estimate.poses = {{"a/1.jpg", {}}, {"b/1.jpg", {}}, {"a/2.jpg", {}}};
  truth.poses = {{"1.jpg", {}}, {"2.jpg", {}}};
  const auto pairs = MatchPoses(estimate, truth);
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].name, "2.jpg");
}

TEST(MatchPoses, FullNamesComeFirst) {
  ModelPoses model;
  model.poses = {{"a/1.jpg", {}}, {"b/1.jpg", {}}};
  EXPECT_EQ(MatchPoses(model, model).size(), 2u);
}

TEST(MatchPoses, NumberedTruthIsPairedByOrder) {
  ModelPoses estimate, truth;
  estimate.poses = {{"y.jpg", {}}, {"x.jpg", {}}};
  truth.poses = {{"0.1", {}}, {"0.2", {}}};
  truth.numbered = true;
  truth.poses[0].pose.translation.x() = 1;
  EXPECT_EQ(MatchPoses(estimate, truth).size(), 2u);
}

}  // namespace skein::pose_evaluation_test
