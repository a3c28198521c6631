#include "matching/photo_features.h"

#include "formats/formats.h"
#include "matching/kernel.h"

namespace skein {
namespace {

// Also false for NaN.
bool IsInside(const Keypoint& keypoint, const Camera& camera) {
  return keypoint.x >= 0 && keypoint.y >= 0 && keypoint.x <= camera.Width() &&
         keypoint.y <= camera.Height();
}

}  // namespace

size_t PhotoFeatures::MemoryBytes() const {
  return sizeof(*this) + points.size() * sizeof(points[0]) + descriptors.size() +
         index.MemoryBytes();
}

PhotoFeaturesPtr CoarsestAlone(const PhotoFeatures& features) {
  auto coarsest = std::make_shared<PhotoFeatures>();
  coarsest->image_id = features.image_id;
  coarsest->index.coarsest = features.index.coarsest;
  coarsest->index.coarse_descriptors = features.index.coarse_descriptors;
  return coarsest;
}

Result<PhotoFeaturesPtr> DecodePhotoFeatures(int64_t image_id, const Camera& camera,
                                             const Bytes& keypoints, const Bytes& descriptors,
                                             const DescriptorCells* cells) {
  const std::string photo = "features of image " + std::to_string(image_id);
  const Result<Keypoints> points = DecodeKeypoints(keypoints);
  if (!points.ok()) return points.status().Within(photo);
  Result<Descriptors> rows = DecodeDescriptors(descriptors);
  if (!rows.ok()) return rows.status().Within(photo);
  if (points->size() != rows->rows()) {
    return DataLoss(photo + ": " + std::to_string(points->size()) + " keypoints but " +
                    std::to_string(rows->rows()) + " descriptors");
  }
  auto features = std::make_shared<PhotoFeatures>();
  features->image_id = image_id;
  features->camera = camera;
  features->points.reserve(points->size());
  std::vector<float> scales_px;
  for (const Keypoint& keypoint : *points) {
    if (!IsInside(keypoint, camera)) return DataLoss(photo + ": keypoint outside the image");
    features->points.emplace_back(keypoint.x, keypoint.y);
    scales_px.push_back(keypoint.scale_px);
  }
  features->descriptors = CompactDescriptors(std::move(rows->data));
  features->index = MakeFeatureIndex(features->points, scales_px, features->descriptors, cells);
  return PhotoFeaturesPtr(std::move(features));
}

}  // namespace skein
