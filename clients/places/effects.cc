#include "clients/places/effects.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "clients/places/random.h"

namespace skein::sim {
namespace {

constexpr double kMinGrey = 1;

cv::Vec3f Bilinear(const cv::Mat3f& image, float x, float y) {
  x = std::clamp(x, 0.0f, static_cast<float>(image.cols - 1));
  y = std::clamp(y, 0.0f, static_cast<float>(image.rows - 1));
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, image.cols - 1), y1 = std::min(y0 + 1, image.rows - 1);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const cv::Vec3f upper = image(y0, x0) * (1 - fx) + image(y0, x1) * fx;
  const cv::Vec3f lower = image(y1, x0) * (1 - fx) + image(y1, x1) * fx;
  return upper * (1 - fy) + lower * fy;
}

}  // namespace

cv::Mat3f BlurAlong(const cv::Mat3f& light, const cv::Mat2f& motion_px) {
  cv::Mat3f blurred(light.size());
  for (int y = 0; y < light.rows; ++y) {
    for (int x = 0; x < light.cols; ++x) {
      const cv::Vec2f& motion = motion_px(y, x);
      const int taps = static_cast<int>(std::ceil(std::hypot(motion[0], motion[1])));
      if (taps < 2) {
        blurred(y, x) = light(y, x);
        continue;
      }
      cv::Vec3f sum(0, 0, 0);
      for (int i = 0; i < taps; ++i) {
        const float along = (static_cast<float>(i) + 0.5f) / static_cast<float>(taps) - 0.5f;
        sum += Bilinear(light, static_cast<float>(x) + along * motion[0],
                        static_cast<float>(y) + along * motion[1]);
      }
      blurred(y, x) = sum / static_cast<float>(taps);
    }
  }
  return blurred;
}

float NoiseSigma(float grey, const Exposure& exposure) {
  const float dark = 1 - std::clamp(grey, 0.0f, 255.0f) / 255;
  const float shot =
      static_cast<float>(exposure.noise_sigma) * std::sqrt(0.5f + std::max(0.0f, grey) / 128);
  return std::hypot(shot, static_cast<float>(exposure.shadow_noise) * dark * dark);
}

cv::Mat3b Expose(const cv::Mat3f& light, const Exposure& exposure) {
  constexpr int kNoiseTable = 1 << 16;
  Random random(exposure.seed);
  std::vector<float> gaussian(kNoiseTable);
  for (float& g : gaussian) g = static_cast<float>(random.Gaussian());
  cv::Mat3f soft = light;
  if (exposure.softness_px > 0) cv::GaussianBlur(light, soft, {}, exposure.softness_px);
  cv::Mat3b photo(light.size());
  const float cx = light.cols / 2.0f, cy = light.rows / 2.0f;
  const float corner2 = cx * cx + cy * cy;
  for (int y = 0; y < light.rows; ++y) {
    for (int x = 0; x < light.cols; ++x) {
      const float r2 = ((x - cx) * (x - cx) + (y - cy) * (y - cy)) / corner2;
      const float gain = static_cast<float>(exposure.gain * (1 - exposure.vignetting * r2));
      const uint64_t noise = random.Next();
      for (int c = 0; c < 3; ++c) {
        const float value = soft(y, x)[c] * gain * exposure.white_balance[c];
        const float g = gaussian[(noise >> (16 * c)) & (kNoiseTable - 1)];
        photo(y, x)[c] = cv::saturate_cast<uchar>(value + NoiseSigma(value, exposure) * g);
      }
    }
  }
  return photo;
}

std::vector<double> AutoExposure(const std::vector<double>& metered_grey, double target_grey,
                                 double interval_s, double lag_s) {
  const double share = 1 - std::exp(-interval_s / lag_s);
  std::vector<double> gains;
  double log_gain = 0;
  for (const double grey : metered_grey) {
    const double wanted = std::log(target_grey / std::max(kMinGrey, grey));
    log_gain = gains.empty() ? wanted : log_gain + share * (wanted - log_gain);
    gains.push_back(std::exp(log_gain));
  }
  return gains;
}

}  // namespace skein::sim
