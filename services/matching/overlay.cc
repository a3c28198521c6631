#include "matching/overlay.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <unordered_set>
#include <utility>

#include "sfm/pose.h"

namespace skein {
namespace {

constexpr int kFields = 8;  // along each side
constexpr int kNumReweighted = 5;
// Share of right matches whose error exceeds the largest of an inlier, and so the standard
// deviation of the errors: that share of a normal distribution lies beyond 1.96 of them.
constexpr double kNoise = 0.05;
constexpr double kSigmaPx = limits::kMaxErrorPx / 1.96;
// An object that moves through a tripod's photos gives one pair in ten a geometry of its own. Three
// pairs do so by chance once in a thousand times.
constexpr int kPairsOfABackground = 3;

bool StandsStill(const PhotoFeatures& first, const PhotoFeatures& second,
                 const FeatureMatch& match) {
  const Eigen::Vector2d& a = first.points[match.point2D_idx1];
  return (a - second.points[match.point2D_idx2]).norm() <= limits::kMaxErrorPx;
}

struct SplitMatches {
  FeatureMatches still, moving;
};

SplitMatches Split(const PhotoFeatures& first, const PhotoFeatures& second,
                   const FeatureMatches& matches) {
  SplitMatches split;
  for (const FeatureMatch& match : matches) {
    const bool is_still = StandsStill(first, second, match);
    (is_still ? split.still : split.moving).push_back(match);
  }
  return split;
}

bool HaveOneSize(const Camera& a, const Camera& b) {
  return a.Width() == b.Width() && a.Height() == b.Height();
}

size_t FieldOf(const PhotoFeatures& photo, const Eigen::Vector2d& point) {
  const auto along = [](double at, size_t length) {
    const int field = static_cast<int>(kFields * at / static_cast<double>(length));
    return std::clamp(field, 0, kFields - 1);
  };
  return along(point.y(), photo.camera.Height()) * kFields + along(point.x(), photo.camera.Width());
}

bool AreFew(const PhotoFeatures& photo, const FeatureMatches& still) {
  std::array<int, kFields * kFields> num_keypoints{}, num_still{};
  for (const Eigen::Vector2d& point : photo.points) ++num_keypoints[FieldOf(photo, point)];
  for (const FeatureMatch& match : still) {
    ++num_still[FieldOf(photo, photo.points[match.point2D_idx1])];
  }
  const double share = static_cast<double>(still.size()) / static_cast<double>(photo.points.size());
  double expected = 0, held = 0;
  for (size_t f = 0; f < num_keypoints.size(); ++f) {
    expected += 1 - std::pow(std::max(0.0, 1 - share), num_keypoints[f]);
    held += num_still[f] > 0;
  }
  return held < expected / 2;
}

// Squared Sampson error, px^2.
double SampsonError(const Eigen::Matrix3d& F, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector3d line = F * a.homogeneous(), back = F.transpose() * b.homogeneous();
  const double product = b.homogeneous().dot(line);
  return product * product / (line.head<2>().squaredNorm() + back.head<2>().squaredNorm());
}

// By the geometry of the moving matches.
bool AreContradicted(const PhotoFeatures& first, const PhotoFeatures& second,
                     const FeatureMatches& still, const TwoViewGeometry& of_moving) {
  if (!IsVerified(of_moving)) return false;
  const Eigen::Matrix3d F = EpipolarModel(first.camera, second.camera, of_moving);
  const auto agrees = [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return SampsonError(F, a, b) <= limits::kMaxErrorPx * limits::kMaxErrorPx;
  };
  const auto num_agreeing =
      static_cast<double>(std::count_if(still.begin(), still.end(), [&](const FeatureMatch& match) {
        return agrees(first.points[match.point2D_idx1], second.points[match.point2D_idx2]);
      }));
  const auto num_by_chance = static_cast<double>(
      std::count_if(first.points.begin(), first.points.end(),
                    [&](const Eigen::Vector2d& point) { return agrees(point, point); }));
  const double by_chance = (num_by_chance + 1) / static_cast<double>(first.points.size() + 2);
  if (by_chance >= 1 - kNoise) return false;
  const double num_others = static_cast<double>(still.size()) - num_agreeing;
  const double log_likelihood_ratio = num_agreeing * std::log(by_chance / (1 - kNoise)) +
                                      num_others * std::log((1 - by_chance) / kNoise);
  return log_likelihood_ratio > 0;
}

// Sum over the matches, px^2, none above the largest of an inlier.
double SumOfErrors(const Eigen::Matrix3d& F, const PhotoFeatures& first,
                   const PhotoFeatures& second, const FeatureMatches& matches) {
  double sum = 0;
  for (const FeatureMatch& match : matches) {
    const double error =
        SampsonError(F, first.points[match.point2D_idx1], second.points[match.point2D_idx2]);
    sum += std::min(error, limits::kMaxErrorPx * limits::kMaxErrorPx);
  }
  return sum;
}

// F = [e]x of a camera that moves without turning: F as of which all that stands still agrees.
// Least squares of the Sampson errors, reweighted from equal weights.
Eigen::Matrix3d FitWithoutTurn(const PhotoFeatures& first, const PhotoFeatures& second,
                               const FeatureMatches& matches) {
  const Eigen::Matrix3d to_plane = first.camera.CalibrationMatrix().inverse();
  Eigen::Vector3d e = Eigen::Vector3d::Zero();
  for (int i = 0; i < kNumReweighted; ++i) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    for (const FeatureMatch& match : matches) {
      const Eigen::Vector3d a = to_plane * first.points[match.point2D_idx1].homogeneous();
      const Eigen::Vector3d b = to_plane * second.points[match.point2D_idx2].homogeneous();
      const double scale =
          i == 0 ? 1 : e.cross(a).head<2>().squaredNorm() + e.cross(b).head<2>().squaredNorm();
      const Eigen::Vector3d line = a.cross(b);
      normal += line * line.transpose() / scale;
    }
    e = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(normal).eigenvectors().col(0);
  }
  return to_plane.transpose() * CrossProductMatrix(e) * to_plane;
}

// Whether the moving matches tell of a motion of their own. One of a plane's geometries contradicts
// the still matches only if no geometry explains both: by the likelihood ratio, less BIC's price of
// F's seven parameters.
bool MoveByThemselves(const PhotoFeatures& first, const PhotoFeatures& second,
                      const TwoViewGeometry& of_moving, const TwoViewGeometry& of_all) {
  if (IsByEssential(of_moving.config)) return true;
  const auto sum = [&](const Eigen::Matrix3d& F) {
    return SumOfErrors(F, first, second, of_moving.inlier_matches);
  };
  double together = sum(FitWithoutTurn(first, second, of_moving.inlier_matches));
  if (IsVerified(of_all)) {
    together = std::min(together, sum(EpipolarModel(first.camera, second.camera, of_all)));
  }
  const double apart = sum(EpipolarModel(first.camera, second.camera, of_moving));
  const double num_matches = static_cast<double>(of_moving.inlier_matches.size());
  return together - apart > 7 * std::log(num_matches) * kSigmaPx * kSigmaPx;
}

std::vector<uint32_t> FirstKeypoints(const FeatureMatches& matches) {
  std::vector<uint32_t> keypoints;
  for (const FeatureMatch& match : matches) keypoints.push_back(match.point2D_idx1);
  return keypoints;
}

// Keypoints that lie within limits::kMaxErrorPx of a marked one, by place: a grid of squares of
// that side.
class Marked {
 public:
  explicit Marked(const std::vector<Eigen::Vector2d>& points) : points_(points) {}

  void Add(const std::vector<uint32_t>& keypoints) {
    for (const uint32_t keypoint : keypoints) squares_[SquareOf(keypoint)].push_back(keypoint);
  }
  bool empty() const { return squares_.empty(); }

  bool IsNear(uint32_t keypoint) const {
    const auto [x, y] = SquareOf(keypoint);
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const auto square = squares_.find({x + dx, y + dy});
        if (square == squares_.end()) continue;
        for (const uint32_t other : square->second) {
          if ((points_[other] - points_[keypoint]).norm() <= limits::kMaxErrorPx) return true;
        }
      }
    }
    return false;
  }

 private:
  std::pair<int, int> SquareOf(uint32_t keypoint) const {
    const Eigen::Vector2d square = points_[keypoint] / limits::kMaxErrorPx;
    return {static_cast<int>(std::floor(square.x())), static_cast<int>(std::floor(square.y()))};
  }

  const std::vector<Eigen::Vector2d>& points_;
  std::map<std::pair<int, int>, std::vector<uint32_t>> squares_;
};

// Whether most of what is background in some pairs moves with the scene in another one.
bool MovesElsewhere(const std::vector<PairWithEvidence>& pairs) {
  std::unordered_set<uint32_t> background;
  for (const PairWithEvidence& pair : pairs) {
    background.insert(pair.evidence.background.begin(), pair.evidence.background.end());
  }
  return std::any_of(pairs.begin(), pairs.end(), [&](const PairWithEvidence& pair) {
    int num_still = 0, num_moving = 0;
    for (size_t i = 0; i < pair.stand_still.size(); ++i) {
      if (background.count(pair.geometry.inlier_matches[i].point2D_idx1) == 0) continue;
      ++(pair.stand_still[i] != 0 ? num_still : num_moving);
    }
    return num_moving >= kMinPairInliers && num_moving > num_still;
  });
}

// Whether the object that moves before the background has a geometry of at least `min_inliers`.
bool HasObject(const PairWithEvidence& pair, int min_inliers) {
  if (pair.evidence.background.empty()) return false;
  return pair.evidence.of_moving->inlier_matches.size() >= static_cast<size_t>(min_inliers);
}

bool HaveABackground(const std::vector<PairWithEvidence>& pairs) {
  const auto num_pairs = [&](int min_inliers) {
    return std::count_if(pairs.begin(), pairs.end(), [min_inliers](const PairWithEvidence& pair) {
      return HasObject(pair, min_inliers);
    });
  };
  return (num_pairs(limits::kMinSeedInliers) > 0 ||
          num_pairs(kMinPairInliers) >= kPairsOfABackground) &&
         !MovesElsewhere(pairs);
}

// Whether the pair is of the background: enough of it stands still, most of that at marked places.
bool StandsOn(const Marked& background, const PairWithEvidence& pair) {
  int num_still = 0, num_marked = 0;
  for (size_t i = 0; i < pair.stand_still.size(); ++i) {
    if (pair.stand_still[i] == 0) continue;
    ++num_still;
    num_marked += background.IsNear(pair.geometry.inlier_matches[i].point2D_idx1);
  }
  return num_still >= kMinPairInliers && 2 * num_marked > num_still;
}

TwoViewGeometry WithoutGeometry() {
  TwoViewGeometry geometry;
  geometry.config = TwoViewGeometry::DEGENERATE;
  return geometry;
}

void LeaveOutBackground(const std::vector<Eigen::Vector2d>& points,
                        std::vector<PairWithEvidence>* pairs) {
  Marked background(points);
  for (const PairWithEvidence& pair : *pairs) background.Add(pair.evidence.background);
  for (PairWithEvidence& pair : *pairs) {
    if (!pair.evidence.background.empty() || StandsOn(background, pair)) KeepMoving(&pair);
  }
}

void LeaveOut(const Marked& overlay, PairWithEvidence* pair) {
  FeatureMatches& inliers = pair->geometry.inlier_matches;
  FeatureMatches kept;
  std::vector<char> stand_still;
  for (size_t i = 0; i < inliers.size(); ++i) {
    if (pair->stand_still[i] != 0 && overlay.IsNear(inliers[i].point2D_idx1)) continue;
    kept.push_back(inliers[i]);
    stand_still.push_back(pair->stand_still[i]);
  }
  inliers = std::move(kept);
  pair->stand_still = std::move(stand_still);
  if (inliers.size() < static_cast<size_t>(kMinPairInliers)) pair->geometry = WithoutGeometry();
}

}  // namespace

PairEstimate EstimateWithoutOverlay(const PhotoFeatures& first, const PhotoFeatures& second,
                                    const FeatureMatches& matches, uint32_t seed) {
  const auto estimate = [&](const FeatureMatches& of) {
    return EstimateTwoView(first.camera, first.points, second.camera, second.points, of, seed);
  };
  if (!HaveOneSize(first.camera, second.camera)) return {estimate(matches), {}};
  const SplitMatches split = Split(first, second, matches);
  if (split.still.size() < static_cast<size_t>(kMinPairInliers)) {
    return {estimate(matches), {}};
  }
  const bool are_few = AreFew(first, split.still);
  TwoViewGeometry of_moving = estimate(split.moving);
  const bool are_contradicted = AreContradicted(first, second, split.still, of_moving);
  PairEstimate result;
  if (are_few && (are_contradicted || !IsVerified(of_moving))) {
    result.geometry = std::move(of_moving);
    if (are_contradicted) result.evidence.overlay = FirstKeypoints(split.still);
    return result;
  }
  result.geometry = estimate(matches);
  if (are_contradicted && MoveByThemselves(first, second, of_moving, result.geometry)) {
    result.evidence.background = FirstKeypoints(split.still);
  }
  if (IsVerified(of_moving)) result.evidence.of_moving = std::move(of_moving);
  return result;
}

std::vector<char> StandStill(const PhotoFeatures& first, const PhotoFeatures& second,
                             const FeatureMatches& matches) {
  std::vector<char> stand_still;
  const bool have_one_size = HaveOneSize(first.camera, second.camera);
  for (const FeatureMatch& match : matches) {
    stand_still.push_back(have_one_size && StandsStill(first, second, match));
  }
  return stand_still;
}

bool IsStill(const PairWithEvidence& pair) {
  if (pair.geometry.config != TwoViewGeometry::PANORAMIC) return false;
  const auto num_still = std::count(pair.stand_still.begin(), pair.stand_still.end(), 1);
  return static_cast<double>(num_still) >=
         (1 - kNoise) * static_cast<double>(pair.stand_still.size());
}

void KeepMoving(PairWithEvidence* pair) {
  pair->geometry = pair->evidence.of_moving.value_or(WithoutGeometry());
  pair->stand_still.assign(pair->geometry.inlier_matches.size(), 0);
}

void LeaveOutOverlay(const std::vector<Eigen::Vector2d>& points,
                     std::vector<PairWithEvidence>* pairs) {
  Marked overlay(points);
  for (const PairWithEvidence& pair : *pairs) overlay.Add(pair.evidence.overlay);
  if (HaveABackground(*pairs)) {
    for (const PairWithEvidence& pair : *pairs) overlay.Add(pair.evidence.background);
    LeaveOutBackground(points, pairs);
  }
  if (overlay.empty()) return;
  for (PairWithEvidence& pair : *pairs) LeaveOut(overlay, &pair);
}

}  // namespace skein
