#include "depth/consistency.h"

#include <algorithm>
#include <cmath>

#include "depth/agreement.h"

namespace skein {
namespace {

// The error of matching that neighbouring pixels and maps have in common: averaging leaves it.
constexpr double kCommonError = 0.2;  // of the errors of the maps

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

bool IsContradicted(const DepthMap& map, int x, int y, const std::vector<Agreement>& agreements) {
  return std::count_if(agreements.begin(), agreements.end(), [&](const Agreement& agreement) {
           return agreement.SeesPast(x, y, map.depth(y, x), map.error(y, x));
         }) >= kMinContradicting;
}

}  // namespace

DepthMap KeepAgreed(const DepthMap& map, const std::vector<const DepthMap*>& others,
                    DepthCounts* counts) {
  DepthCounts count;
  DepthMap kept{map.camera, map.cam_from_world, cv::Mat1f(map.depth.size(), 0.0f),
                cv::Mat1f(map.depth.size(), 0.0f)};
  std::vector<Agreement> agreements;
  for (const DepthMap* other : others) agreements.emplace_back(map, *other);
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      const float depth = map.depth(y, x);
      if (!(depth > 0)) continue;
      Mean mean;
      mean.Add({depth, map.error(y, x)});
      for (const Agreement& agreement : agreements) {
        if (const auto estimate = agreement.Find(x, y, depth)) mean.Add(*estimate);
      }
      if (mean.count() <= kMinAgreeing) {
        if (counts == nullptr) continue;
        ++(IsContradicted(map, x, y, agreements) ? count.contradicted : count.alone);
        continue;
      }
      ++count.agreed;
      kept.depth(y, x) = static_cast<float>(mean.Value());
      kept.error(y, x) = static_cast<float>(mean.Error());
    }
  }
  if (counts != nullptr) *counts = count;
  return kept;
}

}  // namespace skein
