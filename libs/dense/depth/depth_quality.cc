#include "depth/depth_quality.h"

#include <cmath>
#include <cstring>

namespace skein {
namespace {

// Floats above 0 are ordered as their bits are. A bin has the sign, the exponent and the first 8
// bits of the fraction, so it is 1 / 256 of its value wide.
constexpr int kBitsBelow = 15;

class ErrorHistogram {
 public:
  void Add(const DepthMap& map) {
    for (int y = 0; y < map.depth.rows; ++y) {
      for (int x = 0; x < map.depth.cols; ++x) {
        if (map.depth(y, x) > 0 && map.error(y, x) >= 0) Add(map.error(y, x));
      }
    }
  }

  double Percentile(double part) const {
    const auto rank = static_cast<int64_t>(std::ceil(part * static_cast<double>(sum_)));
    int64_t below = 0;
    for (size_t bin = 0; bin < counts_.size(); ++bin) {
      below += counts_[bin];
      if (below > 0 && below >= rank) return MiddleOf(bin);
    }
    return 0;
  }

 private:
  void Add(float error) {
    uint32_t bits = 0;
    std::memcpy(&bits, &error, sizeof(bits));
    ++counts_[bits >> kBitsBelow];
    ++sum_;
  }

  static double MiddleOf(size_t bin) {
    const auto bits = static_cast<uint32_t>(bin << kBitsBelow | 1U << (kBitsBelow - 1));
    float error = 0;
    std::memcpy(&error, &bits, sizeof(error));
    return double{error};
  }

  std::vector<int64_t> counts_ = std::vector<int64_t>(size_t{1} << (32 - kBitsBelow));
  int64_t sum_ = 0;
};

}  // namespace

DepthCounts CountDepths(const DepthMap& sweep, const DepthMap& kept, const cv::Mat1b& mask) {
  DepthCounts counts;
  counts.agreed = cv::countNonZero(kept.depth);
  counts.contradicted = static_cast<int64_t>(mask.total()) - cv::countNonZero(mask);
  counts.alone = cv::countNonZero(sweep.depth) - counts.agreed - counts.contradicted;
  return counts;
}

DepthCounts SumOf(const std::vector<DepthCounts>& counts) {
  DepthCounts sum;
  for (const DepthCounts& one : counts) {
    sum.agreed += one.agreed;
    sum.contradicted += one.contradicted;
    sum.alone += one.alone;
  }
  return sum;
}

ErrorPercentiles PercentilesOfErrors(const std::vector<DepthMap>& maps) {
  ErrorHistogram histogram;
  for (const DepthMap& map : maps) histogram.Add(map);
  return {histogram.Percentile(0.5), histogram.Percentile(0.95)};
}

}  // namespace skein
