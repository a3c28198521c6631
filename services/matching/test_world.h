#pragma once

// Synthetic features for the tests of matching.

#include <Eigen/Geometry>
#include <memory>
#include <random>
#include <vector>

#include "matching/kernel.h"
#include "matching/photo_features.h"
#include "matching/two_view.h"

namespace skein {

// Photos of one cloud of points, each with a descriptor of its own, along a line.
class World {
 public:
  static constexpr double kFocalPx = 1000;
  static constexpr int kSizePx = 2000;

  World() {
    std::uniform_real_distribution<double> at(-3, 3), depth(5, 12);
    for (int i = 0; i < 400; ++i) {
      points_.emplace_back(at(rng_), at(rng_), depth(rng_));
      for (int k = 0; k < kDescriptorDim; ++k) descriptors_.push_back(rng_() % 64);
    }
  }

  // From the first points of the cloud; the rest of its features are its own.
  PhotoFeaturesPtr Photo(int64_t id, double x, size_t num_common) {
    auto photo = std::make_shared<PhotoFeatures>();
    photo->image_id = id;
    photo->camera = PriorCamera(kSizePx, kSizePx, kFocalPx, true);
    for (size_t i = 0; i < points_.size(); ++i) {
      const bool common = i < num_common;
      const Eigen::Vector3d& point = common ? points_[i] : points_[rng_() % points_.size()];
      photo->points.push_back(kFocalPx * (point - Eigen::Vector3d(x, 0, 0)).hnormalized() +
                              Eigen::Vector2d::Constant(kSizePx / 2.));
      for (int k = 0; k < kDescriptorDim; ++k) {
        photo->descriptors.push_back(common ? descriptors_[i * kDescriptorDim + k] : rng_() % 64);
      }
    }
    return photo;
  }

 private:
  std::mt19937 rng_{3};
  std::vector<Eigen::Vector3d> points_;
  std::vector<uint8_t> descriptors_;
};

}  // namespace skein
