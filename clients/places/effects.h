// Effects of a camera on the light that reaches it: blur, exposure, noise. Pure functions of
// images.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace skein::sim {

// Each pixel becomes the mean over the segment of length |motion_px| that it is the middle of. An
// edge across a uniform motion of m pixels becomes a ramp of m pixels.
cv::Mat3f BlurAlong(const cv::Mat3f& light, const cv::Mat2f& motion_px);

struct Exposure {
  double gain = 1;           // exposure
  double vignetting = 0.12;  // loss of light in the corners
  double noise_sigma = 1.5;  // grey levels, in the dark; grows with the square root of light
  uint64_t seed = 1;         // of the noise
  // A small sensor's: grey levels at black, none at white. A gamma curve makes this of constant
  // sensor noise.
  double shadow_noise = 0;
  double softness_px = 0;               // of the lens: a Gaussian's standard deviation
  cv::Vec3f white_balance = {1, 1, 1};  // gains of blue, green, red
};

// Standard deviation of the noise, in grey levels, at a grey level.
float NoiseSigma(float grey, const Exposure& exposure);

cv::Mat3b Expose(const cv::Mat3f& light, const Exposure& exposure);

// Gains of a video's frames by an automatic exposure that wants `target_grey`. Its logarithm
// follows the wanted one with the time constant `lag_s`. The first frame has its wanted gain.
std::vector<double> AutoExposure(const std::vector<double>& metered_grey, double target_grey,
                                 double interval_s, double lag_s);

}  // namespace skein::sim
