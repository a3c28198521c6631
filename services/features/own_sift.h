#pragma once

#include "features/scale_space.h"
#include "features/sift.h"

namespace skein {

// Skein's own SIFT (Lowe 2004; its parameters and the order of a descriptor's values are OpenCV's).
// Keeps the scale space's memory from photo to photo. One thread's.
class OwnSift {
 public:
  // Throws std::invalid_argument if this processor does not run options.kernel.
  explicit OwnSift(const SiftOptions& options);

  // As OpenCvSift.
  LocalFeatures Extract(const cv::Mat& grey, int threads);

 private:
  // An extremum and one of its directions.
  struct Oriented {
    Extremum extremum;
    float angle_rad = 0;
  };

  std::vector<Extremum> FindExtrema(const cv::Mat& grey, int threads);
  std::vector<Oriented> Orient(const std::vector<Extremum>& extrema, int threads) const;
  template <typename T, typename Get>
  std::vector<T> Strongest(const std::vector<T>& all, cv::Size size, const Get& get) const;

  const SiftOptions options_;
  const SiftKernels& kernels_;
  ScaleSpace scale_space_;
};

}  // namespace skein
