// Effects of a camera on the light that reaches it: blur, exposure, noise. Pure functions of
// images.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace skein::sim {

// Motion blur: blurred(x) = mean of light(x + s motion_px(x)) over -1/2 <= s <= 1/2. An edge across
// a uniform motion of m pixels becomes a ramp of m pixels.
cv::Mat3f BlurAlong(const cv::Mat3f& light, const cv::Mat2f& motion_px);

struct Exposure {
  double gain = 1;           // exposure
  double vignetting = 0.12;  // loss of light in the corners
  double noise_sigma = 1.5;  // grey levels, in the dark; grows with the square root of light
  uint64_t seed = 1;         // of the noise
  // Further noise of a small sensor, standard deviation in grey levels: this value at black, 0 at
  // white. A gamma curve turns constant sensor noise into such noise.
  double shadow_noise = 0;
  double softness_px = 0;               // of the lens: a Gaussian's standard deviation
  cv::Vec3f white_balance = {1, 1, 1};  // gains of blue, green, red
};

// Standard deviation of the noise, in grey levels, at a grey level.
float NoiseSigma(float grey, const Exposure& exposure);

cv::Mat3b Expose(const cv::Mat3f& light, const Exposure& exposure);

// Gains of a video's frames by an automatic exposure. The wanted gain of frame i is w_i =
// target_grey / metered_grey[i]. log g_0 = log w_0; log g_i = log g_(i-1) + (1 - exp(-interval_s /
// lag_s)) (log w_i - log g_(i-1)).
std::vector<double> AutoExposure(const std::vector<double>& metered_grey, double target_grey,
                                 double interval_s, double lag_s);

}  // namespace skein::sim
