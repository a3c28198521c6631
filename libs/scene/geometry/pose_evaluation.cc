#include "geometry/pose_evaluation.h"

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "core/angles.h"

namespace skein {
namespace {

constexpr std::array<double, 3> kAucLimitsDeg = {1, 3, 5};

using Key = std::function<std::string(const std::string&)>;

std::string FileName(const std::string& name) { return name.substr(name.find_last_of('/') + 1); }
std::string Stem(const std::string& name) {
  const std::string file = FileName(name);
  return file.substr(0, file.find_last_of('.'));
}

// Index by key; -1 where a key is not unique.
std::map<std::string, int> IndexBy(const std::vector<NamedPose>& poses, const Key& key) {
  std::map<std::string, int> index;
  for (size_t i = 0; i < poses.size(); ++i) {
    const auto [entry, is_new] = index.emplace(key(poses[i].name), static_cast<int>(i));
    if (!is_new) entry->second = -1;
  }
  return index;
}

std::vector<PosePair> MatchByOrder(const ModelPoses& estimate, const ModelPoses& truth) {
  std::vector<NamedPose> sorted = estimate.poses;
  std::sort(sorted.begin(), sorted.end(),
            [](const NamedPose& a, const NamedPose& b) { return a.name < b.name; });
  std::vector<PosePair> pairs;
  if (sorted.size() != truth.poses.size()) return pairs;
  for (size_t i = 0; i < sorted.size(); ++i) {
    pairs.push_back({truth.poses[i].name, sorted[i].pose, truth.poses[i].pose});
  }
  return pairs;
}

double AngleDeg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return RadToDeg(std::atan2(a.cross(b).norm(), a.dot(b)));
}

double AngleDeg(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  const Eigen::Quaterniond difference = a * b.conjugate();
  return RadToDeg(2 * std::atan2(difference.vec().norm(), std::abs(difference.w())));
}

ErrorSummary Summarize(std::vector<double> errors) {
  ErrorSummary summary;
  if (errors.empty()) return summary;
  std::sort(errors.begin(), errors.end());
  const size_t n = errors.size();
  for (const double error : errors) {
    summary.mean += error / static_cast<double>(n);
    summary.rmse += error * error / static_cast<double>(n);
  }
  summary.rmse = std::sqrt(summary.rmse);
  summary.median = (errors[(n - 1) / 2] + errors[n / 2]) / 2;
  summary.max = errors.back();
  return summary;
}

double Extent(const std::vector<NamedPose>& poses) {
  double extent = 0;
  for (size_t i = 0; i < poses.size(); ++i) {
    for (size_t k = 0; k < i; ++k) {
      extent = std::max(extent, (poses[i].pose.Centre() - poses[k].pose.Centre()).norm());
    }
  }
  return extent;
}

// Mean rotation from the orientations; scale and translation from the centres.
Result<Similarity> AlignByOrientation(const std::vector<PosePair>& pairs) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d mean_estimate = Eigen::Vector3d::Zero(), mean_truth = Eigen::Vector3d::Zero();
  for (const PosePair& pair : pairs) {
    sum += (pair.truth.rotation.conjugate() * pair.estimate.rotation).toRotationMatrix();
    mean_estimate += pair.estimate.Centre() / static_cast<double>(pairs.size());
    mean_truth += pair.truth.Centre() / static_cast<double>(pairs.size());
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d rotation = svd.matrixU() * svd.matrixV().transpose();
  if (rotation.determinant() < 0) {
    rotation = svd.matrixU() * Eigen::Vector3d(1, 1, -1).asDiagonal() * svd.matrixV().transpose();
  }
  double dot = 0, square = 0;
  for (const PosePair& pair : pairs) {
    const Eigen::Vector3d from = rotation * (pair.estimate.Centre() - mean_estimate);
    dot += from.dot(pair.truth.Centre() - mean_truth);
    square += from.squaredNorm();
  }
  if (!(square > 0) || !(dot > 0))
    return FailedPrecondition("the camera centres don't fix a scale");
  Similarity result;
  result.rotation = Eigen::Quaterniond(rotation).normalized();
  result.scale = dot / square;
  result.translation = mean_truth - result.scale * (result.rotation * mean_estimate);
  return result;
}

// False: what spread there is comes from rounding.
bool AreSpread(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) mean += point / static_cast<double>(points.size());
  double spread = 0;
  for (const Eigen::Vector3d& point : points) spread = std::max(spread, (point - mean).norm());
  return spread > 1e-9 * mean.norm();
}

double RelativePoseErrorDeg(const PosePair& a, const PosePair& b) {
  const double rotation = AngleDeg(b.estimate.rotation * a.estimate.rotation.conjugate(),
                                   b.truth.rotation * a.truth.rotation.conjugate());
  const Eigen::Vector3d estimated =
      a.estimate.rotation * (b.estimate.Centre() - a.estimate.Centre());
  const Eigen::Vector3d true_baseline = a.truth.rotation * (b.truth.Centre() - a.truth.Centre());
  if (true_baseline.norm() < 1e-12) return rotation;  // no direction to compare
  return std::max(rotation, AngleDeg(estimated, true_baseline));
}

void AddAuc(const std::vector<PosePair>& pairs, PoseEvaluation* evaluation) {
  std::array<double, 3> areas{};
  for (size_t i = 0; i < pairs.size(); ++i) {
    for (size_t k = 0; k < i; ++k) {
      const double error = RelativePoseErrorDeg(pairs[k], pairs[i]);
      for (size_t j = 0; j < areas.size(); ++j) {
        areas[j] += std::max(0.0, 1 - error / kAucLimitsDeg[j]);
      }
    }
  }
  const double total = static_cast<double>(evaluation->total);
  const double all_pairs = std::max(1.0, total * (total - 1) / 2);
  evaluation->auc_1deg = areas[0] / all_pairs;
  evaluation->auc_3deg = areas[1] / all_pairs;
  evaluation->auc_5deg = areas[2] / all_pairs;
}

}  // namespace

std::vector<PosePair> MatchPoses(const ModelPoses& estimate, const ModelPoses& truth) {
  const Key keys[] = {[](const std::string& name) { return name; }, FileName, Stem};
  std::vector<PosePair> pairs;
  std::set<int> taken;
  std::vector<bool> paired(truth.poses.size(), false);
  for (const Key& key : keys) {
    const std::map<std::string, int> estimates = IndexBy(estimate.poses, key);
    for (const auto& [name, i] : IndexBy(truth.poses, key)) {
      const auto found = estimates.find(name);
      if (i < 0 || paired[i] || found == estimates.end() || found->second < 0) continue;
      if (!taken.insert(found->second).second) continue;
      paired[i] = true;
      pairs.push_back(
          {truth.poses[i].name, estimate.poses[found->second].pose, truth.poses[i].pose});
    }
  }
  return pairs.empty() && truth.numbered ? MatchByOrder(estimate, truth) : pairs;
}

Result<Similarity> AlignPoses(const std::vector<PosePair>& pairs, bool* by_orientation) {
  if (pairs.size() < 3) {
    return FailedPrecondition(std::to_string(pairs.size()) +
                              " photos in common; three are needed to align");
  }
  std::vector<Eigen::Vector3d> from, to;
  for (const PosePair& pair : pairs) {
    from.push_back(pair.estimate.Centre());
    to.push_back(pair.truth.Centre());
  }
  if (!AreSpread(from) || !AreSpread(to)) return FailedPrecondition("the camera centres coincide");
  *by_orientation = false;
  if (const auto similarity = SimilarityFromPoints(from, to)) return *similarity;
  *by_orientation = true;
  return AlignByOrientation(pairs);
}

Result<PoseEvaluation> EvaluatePoses(const ModelPoses& estimate, const ModelPoses& truth) {
  const std::vector<PosePair> pairs = MatchPoses(estimate, truth);
  PoseEvaluation evaluation;
  const Result<Similarity> aligned = AlignPoses(pairs, &evaluation.aligned_by_orientation);
  if (!aligned) return aligned.status();
  evaluation.truth_from_estimate = *aligned;
  evaluation.registered = pairs.size();
  evaluation.total = truth.poses.size();
  evaluation.extent = Extent(truth.poses);
  std::vector<double> position, rotation;
  for (const PosePair& pair : pairs) {
    const CameraPose moved = TransformPose(*aligned, pair.estimate);
    position.push_back((moved.Centre() - pair.truth.Centre()).norm());
    rotation.push_back(AngleDeg(moved.rotation, pair.truth.rotation));
  }
  evaluation.position = Summarize(position);
  evaluation.rotation_deg = Summarize(rotation);
  AddAuc(pairs, &evaluation);
  return evaluation;
}

}  // namespace skein
