// Features of photos of one synthetic scene, for the tests of matching. Each of 400 points has a
// descriptor of its own.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "matching/photo_features.h"
#include "testing/synthetic_scene.h"

namespace skein {

class SyntheticFeatures {
 public:
  static constexpr double kFocalPx = 1000;
  static constexpr int kSizePx = 2000;  // width and height

  SyntheticFeatures();

  // A photo from (x, 0, 0) along z. The photo has all points in view, so feature i is of point i.
  // The first `num_common` have the scene's descriptors, the others random ones.
  PhotoFeaturesPtr Photo(int64_t id, double x, size_t num_common);

 private:
  std::mt19937 random_{3};
  SyntheticScene scene_;
  std::vector<uint8_t> descriptors_;  // 400 x 128, row major
};

}  // namespace skein
