// How good depth maps are, by the true surface.
#pragma once

#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "clients/places/scene.h"
#include "depth/depth_map.h"

namespace skein {

// The surfaces of a PLY file that `skein sim` wrote. Throws std::runtime_error for another.
sim::Scene ReadSurfaces(const std::string& file);

// Depths of the surface; 0: the sky.
cv::Mat1f TrueDepth(const sim::Scene& scene, const DepthCamera& camera, const DepthPose& pose);

// Standard deviation of 7 x 7 grey values of 4 or more.
cv::Mat1b Textured(const cv::Mat1b& grey);

// The true surface and the photos of it.
class TruePlace {
 public:
  TruePlace(const sim::Scene& scene, const std::vector<DepthPhoto>& photos)
      : scene_(scene), photos_(photos) {}

  Eigen::Vector3d Point(int photo, int x, int y, float depth) const;
  bool Sees(int photo, const Eigen::Vector3d& point) const;
  // Whether `other` sees the point of photo `photo` from 1 to 45 degrees aside.
  bool SeesToo(int photo, int other, const Eigen::Vector3d& point) const;
  // Whether a depth can be confirmed: two others see its point.
  bool IsSeenByThree(int photo, const Eigen::Vector3d& point) const;
  // 255 where the point of the true depth is; 0 in the sky.
  cv::Mat1b SeenByThree(int photo, const cv::Mat1f& truth) const;

 private:
  const sim::Scene& scene_;
  const std::vector<DepthPhoto>& photos_;
};

// Collects the errors of maps.
class DepthFigures {
 public:
  // `grey`: the photo. `seen`: TruePlace::SeenByThree; empty: not known.
  void Add(const DepthMap& map, const cv::Mat1f& truth, const cv::Mat1b& grey,
           const cv::Mat1b& seen);

  // Shares within 1 and 2 % of the true depth (a depth in the sky is wrong), completeness (of all,
  // of textured; each also of what three photos see), the median error in ground sampling
  // distances. The calibration has bins of the predicted error, each with the 68th percentile of
  // the true ones, and the slope of a line through them.
  nlohmann::json ToJson() const;

 private:
  struct Sample {
    float predicted, error, gsd, depth;
  };
  // Pixels of a kind of surface.
  struct Share {
    size_t all = 0, found = 0;
    void Add(bool is_found) { ++all, found += is_found; }
    double Value() const { return all == 0 ? 0 : static_cast<double>(found) / all; }
  };
  nlohmann::json Calibration() const;

  std::vector<Sample> samples_;
  Share surface_, textured_, seen_, seen_textured_;
  size_t invented_ = 0;
};

}  // namespace skein
