#include "benchmark/depth/depth_losses.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

namespace skein {
namespace {

constexpr int kStride = 2;  // pixels
constexpr double kWrong = 0.02;

struct Pixel {
  int photo, x, y;
  float truth;
};

class Losses {
 public:
  Losses(const DepthInput& input, const std::vector<DepthMap>& sweeps,
         const std::vector<DepthMap>& agreed, const TruePlace& place)
      : input_(input), sweeps_(sweeps), agreed_(agreed), place_(place) {}

  std::string CauseOf(const Pixel& pixel) const {
    const float agreed = agreed_[pixel.photo].depth(pixel.y, pixel.x);
    if (agreed > 0) return IsWrong(agreed, pixel) ? "agreed_wrong" : "agreed_right";
    const Eigen::Vector3d point = place_.Point(pixel.photo, pixel.x, pixel.y, pixel.truth);
    if (!place_.IsSeenByThree(pixel.photo, point)) return "not_seen_by_three";
    const int matched = NumMatchedThatSee(pixel, point);
    if (matched == 0) return "no_neighbour_sees_it";
    const float found = sweeps_[pixel.photo].depth(pixel.y, pixel.x);
    if (found > 0 && !IsWrong(found, pixel)) return "not_confirmed";
    if (!IsInRange(pixel)) return "out_of_range";
    const std::string cause = found > 0 ? "sweep_wrong" : "sweep_hole";
    return matched == 1 ? cause + "_one_neighbour" : cause;
  }

 private:
  static bool IsWrong(float depth, const Pixel& pixel) {
    return std::abs(depth - pixel.truth) > kWrong * pixel.truth;
  }
  bool IsInRange(const Pixel& pixel) const {
    const auto& range = input_.ranges[pixel.photo];
    return range && pixel.truth >= range->near && pixel.truth <= range->far;
  }
  int NumMatchedThatSee(const Pixel& pixel, const Eigen::Vector3d& point) const {
    const std::vector<int>& neighbours = input_.neighbours[pixel.photo];
    const auto end =
        neighbours.begin() + static_cast<std::ptrdiff_t>(std::min(neighbours.size(), kNumMatched));
    return static_cast<int>(std::count_if(neighbours.begin(), end, [&](int other) {
      return place_.SeesToo(pixel.photo, other, point);
    }));
  }

  const DepthInput& input_;
  const std::vector<DepthMap>&sweeps_, &agreed_;
  const TruePlace& place_;
};

}  // namespace

nlohmann::json LossesOf(const DepthInput& input, const std::vector<DepthMap>& sweeps,
                        const std::vector<DepthMap>& agreed, const TruePlace& place,
                        const std::vector<cv::Mat1f>& truths) {
  const Losses losses(input, sweeps, agreed, place);
  std::map<std::string, size_t> counts;
  size_t sum = 0;
  for (int i = 0; i < static_cast<int>(truths.size()); ++i) {
    for (int y = 0; y < truths[i].rows; y += kStride) {
      for (int x = 0; x < truths[i].cols; x += kStride) {
        if (!(truths[i](y, x) > 0)) continue;
        ++counts[losses.CauseOf({i, x, y, truths[i](y, x)})];
        ++sum;
      }
    }
  }
  nlohmann::json shares;
  for (const auto& [cause, count] : counts) {
    shares[cause] = static_cast<double>(count) / static_cast<double>(sum);
  }
  return shares;
}

}  // namespace skein
