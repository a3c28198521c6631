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

// Collects the errors of maps.
class DepthFigures {
 public:
  // `grey`: the photo. Pixels are textured where the standard deviation of 7 x 7 is 4 or more.
  void Add(const DepthMap& map, const cv::Mat1f& truth, const cv::Mat1b& grey);

  // Shares within 1 and 2 % of the true depth (a depth in the sky is wrong), completeness (of all,
  // of textured), the median error in ground sampling distances. The calibration has bins of the
  // predicted error, each with the 68th percentile of the true ones, and the slope of a line
  // through them.
  nlohmann::json ToJson() const;

 private:
  struct Sample {
    float predicted, error, gsd, depth;
  };
  nlohmann::json Calibration() const;

  std::vector<Sample> samples_;
  size_t surface_ = 0, found_ = 0, textured_ = 0, textured_found_ = 0, invented_ = 0;
};

}  // namespace skein
