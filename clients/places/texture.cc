#include "clients/places/texture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace skein::sim {

Texture::Texture(cv::Mat3b base, float texels_per_m, Edge edge) : edge_(edge) {
  const Eigen::Vector2f size_m(base.cols / texels_per_m, base.rows / texels_per_m);
  levels_.push_back(std::move(base));
  while (std::min(levels_.back().cols, levels_.back().rows) > 1) {
    const cv::Mat3b& fine = levels_.back();
    cv::Mat3b coarse;
    cv::resize(fine, coarse, cv::Size((fine.cols + 1) / 2, (fine.rows + 1) / 2), 0, 0,
               cv::INTER_AREA);
    levels_.push_back(coarse);
  }
  for (const cv::Mat3b& level : levels_) {
    texels_per_m_.emplace_back(level.cols / size_m.x(), level.rows / size_m.y());
  }
}

float Texture::Level(float footprint_m) const {
  return std::log2(footprint_m * texels_per_m_[0].x());
}

Eigen::Vector3f Texture::Sample(float u_m, float v_m, float level) const {
  const float top = static_cast<float>(levels_.size()) - 1.001f;
  const float clamped = std::clamp(level, 0.0f, std::max(0.0f, top));
  const int fine = static_cast<int>(clamped);
  const float fraction = clamped - static_cast<float>(fine);
  const Eigen::Vector3f color = Bilinear(fine, u_m, v_m);
  if (fraction < 0.02f) return color;
  return color + fraction * (Bilinear(fine + 1, u_m, v_m) - color);
}

Eigen::Vector3f Texture::Bilinear(int level, float u_m, float v_m) const {
  const cv::Mat3b& image = levels_[level];
  const float x = u_m * texels_per_m_[level].x() - 0.5f;
  const float y = v_m * texels_per_m_[level].y() - 0.5f;
  const float floor_x = std::floor(x), floor_y = std::floor(y);
  const float fx = x - floor_x, fy = y - floor_y;
  const auto place = [this](int i, int n) {
    if (edge_ == Edge::kClamp) return std::clamp(i, 0, n - 1);
    return (i % n + n) % n;
  };
  const int x0 = place(static_cast<int>(floor_x), image.cols);
  const int x1 = place(static_cast<int>(floor_x) + 1, image.cols);
  const cv::Vec3b* row0 = image[place(static_cast<int>(floor_y), image.rows)];
  const cv::Vec3b* row1 = image[place(static_cast<int>(floor_y) + 1, image.rows)];
  const float w00 = (1 - fx) * (1 - fy), w10 = fx * (1 - fy), w01 = (1 - fx) * fy, w11 = fx * fy;
  Eigen::Vector3f color;
  for (int c = 0; c < 3; ++c) {
    color[c] = w00 * row0[x0][c] + w10 * row0[x1][c] + w01 * row1[x0][c] + w11 * row1[x1][c];
  }
  return color;
}

}  // namespace skein::sim
