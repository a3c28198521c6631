#include "testing/synthetic_features.h"

#include <memory>
#include <stdexcept>

#include "matching/two_view.h"
#include "testing/test_random.h"

namespace skein {
namespace {

constexpr int kNumPoints = 400;

SyntheticOptions CameraOptions() {
  SyntheticOptions options;
  options.camera.width_px = options.camera.height_px = SyntheticFeatures::kSizePx;
  options.camera.focal_px = SyntheticFeatures::kFocalPx;
  options.noise_px = 0;
  return options;
}

}  // namespace

SyntheticFeatures::SyntheticFeatures() {
  for (int i = 0; i < kNumPoints; ++i) {
    const double x = Uniform(-3, 3, &random_), y = Uniform(-3, 3, &random_);
    scene_.points.emplace_back(x, y, Uniform(5, 12, &random_));
    for (int k = 0; k < kDescriptorDim; ++k) descriptors_.push_back(random_() % 32);
  }
}

PhotoFeaturesPtr SyntheticFeatures::Photo(int64_t id, double x, size_t num_common) {
  scene_.AddPose(Eigen::Matrix3d::Identity(), {x, 0, 0});
  PhotographNext(CameraOptions(), &random_, &scene_);
  const Keypoints& keypoints = scene_.photos.back().keypoints;
  if (keypoints.size() != kNumPoints) throw std::logic_error("a point is out of view");
  auto photo = std::make_shared<PhotoFeatures>();
  photo->image_id = id;
  photo->camera = PriorCamera(kSizePx, kSizePx, kFocalPx, true);
  for (const Keypoint& keypoint : keypoints) photo->points.emplace_back(keypoint.x, keypoint.y);
  photo->descriptors = descriptors_;
  for (size_t k = num_common * kDescriptorDim; k < photo->descriptors.size(); ++k) {
    photo->descriptors[k] = random_() % 32;
  }
  return photo;
}

}  // namespace skein
