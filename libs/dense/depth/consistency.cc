#include "depth/consistency.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "depth/agreement.h"

namespace skein {
namespace {

// The error of matching that neighbouring pixels and maps have in common: averaging leaves it.
constexpr double kCommonError = 0.25;  // of the errors of the maps

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
    const double variance = std::max(0.0, squares_ / weight_ - Value() * Value());
    const double single = count_ / weight_;  // mean squared error of one
    const double common = kCommonError * kCommonError * single;
    return std::sqrt(common + std::max(single, variance) / count_);
  }

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

// The number of maps that agree with a pixel, kMinAgreeing at most.
int CountAgreeing(const DepthMap& map, int x, int y, const std::vector<Agreement>& others,
                  Mean* mean) {
  for (const Agreement& other : others) {
    if (const auto estimate = other.Find(x, y, map.depth(y, x))) mean->Add(*estimate);
  }
  return std::min(mean->count() - 1, kMinAgreeing);
}

// The means of all pixels that a map agrees with. `agreeing`: how many do.
DepthMap MeanOfAgreeing(const DepthMap& map, const std::vector<Agreement>& others,
                        cv::Mat1f* agreeing) {
  DepthMap means{map.camera, map.cam_from_world, cv::Mat1f(map.depth.size(), 0.0f),
                 cv::Mat1f(map.depth.size(), 0.0f)};
  *agreeing = cv::Mat1f(map.depth.size(), 0.0f);
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      if (!(map.depth(y, x) > 0)) continue;
      Mean mean;
      mean.Add({map.depth(y, x), map.error(y, x)});
      const int count = CountAgreeing(map, x, y, others, &mean);
      if (count == 0) continue;
      (*agreeing)(y, x) = static_cast<float>(count);
      means.depth(y, x) = static_cast<float>(mean.Value());
      means.error(y, x) = static_cast<float>(mean.Error());
    }
  }
  return means;
}

}  // namespace

DepthMap KeepAgreed(const DepthMap& map, const std::vector<const DepthMap*>& others) {
  cv::Mat1f agreeing, around;
  DepthMap kept = MeanOfAgreeing(map, AgreementsOf(map, others), &agreeing);
  const cv::Size patch(kAgreementPatch, kAgreementPatch);
  cv::boxFilter(agreeing, around, -1, patch, cv::Point(-1, -1), false);
  const float most = static_cast<float>(kMinAgreeing * patch.area());
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      float &depth = kept.depth(y, x), &error = kept.error(y, x);
      if (around(y, x) < static_cast<float>(patch.area()) + 0.5f) depth = error = 0;
      error = std::hypot(error, (1 - around(y, x) / most) * kMaxDepthDifference * depth);
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
