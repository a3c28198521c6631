#include "depth/consistency.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "depth/agreement.h"

namespace skein {
namespace {

// Parts of the errors of the maps: of a depth that others agree with, which is wrong less often;
// what maps have in common, so that averaging leaves it (measured: docs/experiments/depth.md).
constexpr double kAgreedError = 0.6, kCommonError = 0.25;
// The error beside an edge of depth: so many times the share of the maps that see past the depth,
// times the geometric mean of the agreeing depths' spread and of the edge's height.
constexpr float kEdgeError = 2.3f;
constexpr float kMaxEdgeHeight = 0.05f;  // of the depth: what lies farther behind moves no match

class Mean {
 public:
  void Add(const DepthEstimate& estimate) {
    const double weight = 1 / (estimate.error * estimate.error);
    weight_ += weight;
    sum_ += weight * estimate.depth;
    squares_ += weight * estimate.depth * estimate.depth;
    ++count_;
  }
  int count() const { return count_; }
  double Value() const { return sum_ / weight_; }
  double Error() const {
    const double single = count_ / weight_;  // mean squared error of one
    const double common = kCommonError * kCommonError * single;
    const double agreed = kAgreedError * kAgreedError * single;
    return std::sqrt(common + std::max(agreed, Variance()) / count_);
  }
  double Variance() const { return std::max(0.0, squares_ / weight_ - Value() * Value()); }

 private:
  double weight_ = 0, sum_ = 0, squares_ = 0;
  int count_ = 0;
};

// Both the sweep's map and its agreed depths see past the depth: the former knows edges better.
bool IsContradicted(const DepthMap& map, int x, int y, const std::vector<Agreement>& others,
                    const std::vector<Agreement>& agreed) {
  const float depth = map.depth(y, x), error = map.error(y, x);
  int contradicting = 0;
  for (size_t i = 0; i < others.size(); ++i) {
    contradicting +=
        agreed[i].SeesPast(x, y, depth, error) && others[i].SeesPast(x, y, depth, error);
  }
  if (contradicting < kMinContradicting) return false;
  return std::count_if(others.begin(), others.end(), [&](const Agreement& other) {
           return other.Find(x, y, depth).has_value();
         }) < contradicting;
}

// The other maps' votes on the depths of a map, of each pixel and then means over a patch.
class Votes {
 public:
  explicit Votes(cv::Size size)
      : sums_(size, Sums(0, 0, 0, 0)), of_agreed_(size, cv::Vec2f(0, 0)) {}

  // The mean of a pixel's depth and those that agree.
  Mean Take(const DepthMap& map, int x, int y, const std::vector<Agreement>& others) {
    Mean mean;
    mean.Add({map.depth(y, x), map.error(y, x)});
    Sums& sums = sums_(y, x);
    for (const Agreement& other : others) {
      float behind = 0;
      const auto estimate = other.Find(x, y, map.depth(y, x), &behind);
      if (estimate) mean.Add(*estimate);
      sums[kPast] += behind > 0;
      sums[kBehind] += std::min(behind, kMaxEdgeHeight);
    }
    const int agreeing = mean.count() - 1;
    sums[kAgreeing] = static_cast<float>(agreeing);
    sums[kCounted] = static_cast<float>(std::min(agreeing, kMinAgreeing));
    if (agreeing > 0) of_agreed_(y, x) = {1, RelativeVariance(mean)};
    return mean;
  }

  void AverageOverPatches() {
    const cv::Size patch(kAgreementPatch, kAgreementPatch);
    cv::boxFilter(sums_, sums_, -1, patch);
    cv::boxFilter(of_agreed_, of_agreed_, -1, patch);
  }

  // A mean of more than one agrees.
  bool IsAgreed(int x, int y) const {
    constexpr float kHalfVote = 0.5f / (kAgreementPatch * kAgreementPatch);
    return sums_(y, x)[kCounted] > 1 + kHalfVote;
  }

  // As a part of the depth.
  float EdgeError(int x, int y) const {
    const Sums& sums = sums_(y, x);
    if (!(sums[kPast] > 0)) return 0;
    const float share = sums[kPast] / (sums[kAgreeing] + sums[kPast]);
    const float height = sums[kBehind] / sums[kPast];
    const float spread = std::sqrt(std::max(0.0f, of_agreed_(y, x)[1]) / of_agreed_(y, x)[0]);
    return kEdgeError * share * std::sqrt(height * spread);
  }

 private:
  enum { kCounted, kAgreeing, kPast, kBehind };
  typedef cv::Vec4f Sums;

  static float RelativeVariance(const Mean& mean) {
    const double unbiased = mean.Variance() * mean.count() / (mean.count() - 1);
    return static_cast<float>(unbiased / (mean.Value() * mean.Value()));
  }

  cv::Mat_<Sums> sums_;
  cv::Mat_<cv::Vec2f> of_agreed_;  // whether a map agrees, variance of what agrees
};

// The means of all pixels that a map agrees with.
DepthMap MeanOfAgreeing(const DepthMap& map, const std::vector<Agreement>& others, Votes* votes) {
  DepthMap means{map.camera, map.cam_from_world, cv::Mat1f(map.depth.size(), 0.0f),
                 cv::Mat1f(map.depth.size(), 0.0f)};
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      if (!(map.depth(y, x) > 0)) continue;
      const Mean mean = votes->Take(map, x, y, others);
      if (mean.count() == 1) continue;
      means.depth(y, x) = static_cast<float>(mean.Value());
      means.error(y, x) = static_cast<float>(mean.Error());
    }
  }
  return means;
}

}  // namespace

DepthMap KeepAgreed(const DepthMap& map, const std::vector<const DepthMap*>& others) {
  Votes votes(map.depth.size());
  DepthMap kept = MeanOfAgreeing(map, AgreementsOf(map, others), &votes);
  votes.AverageOverPatches();
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      float &depth = kept.depth(y, x), &error = kept.error(y, x);
      if (!votes.IsAgreed(x, y)) depth = error = 0;
      if (depth > 0) error = std::hypot(error, votes.EdgeError(x, y) * depth);
    }
  }
  return kept;
}

cv::Mat1b StaticMask(const DepthMap& map, const std::vector<const DepthMap*>& others,
                     const std::vector<const DepthMap*>& agreed) {
  const std::vector<Agreement> of_others = AgreementsOf(map, others),
                               of_agreed = AgreementsOf(map, agreed);
  cv::Mat1b mask(map.depth.size(), 255);
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      if (!(map.depth(y, x) > 0)) continue;
      if (IsContradicted(map, x, y, of_others, of_agreed)) mask(y, x) = 0;
    }
  }
  return mask;
}

}  // namespace skein
