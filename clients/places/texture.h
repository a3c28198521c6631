// A painted surface with its mip pyramid. Trilinear sampling is band-limited, so features stay in
// place from photo to photo.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

namespace skein::sim {

class Texture {
 public:
  enum class Edge { kClamp, kRepeat };

  // `base`: BGR, `texels_per_m` along both axes.
  Texture(cv::Mat3b base, float texels_per_m, Edge edge);

  // Pyramid level whose texels are `footprint_m` wide; below 0: the texture is magnified.
  float Level(float footprint_m) const;
  // BGR in 0..255 at (u right, v down), metres from the upper left corner.
  Eigen::Vector3f Sample(float u_m, float v_m, float level) const;

 private:
  Eigen::Vector3f Bilinear(int level, float u_m, float v_m) const;

  std::vector<cv::Mat3b> levels_;
  std::vector<Eigen::Vector2f> texels_per_m_;  // of each level; halving rounds
  Edge edge_;
};

}  // namespace skein::sim
