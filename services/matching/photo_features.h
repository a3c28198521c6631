#pragma once

// Local features of one photo as matching needs them.

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/bytes.h"
#include "core/result.h"
#include "matching/feature_index.h"
#include "sfm/camera.h"

namespace skein {

struct PhotoFeatures {
  int64_t image_id = 0;
  Camera camera;
  std::vector<Eigen::Vector2d> points;  // full-resolution pixels
  std::vector<uint8_t> descriptors;     // points.size() x 128, row major, compact (kernel.h)
  FeatureIndex index;                   // of these; without cells the photo is matched in full

  size_t MemoryBytes() const;
};

using PhotoFeaturesPtr = std::shared_ptr<const PhotoFeatures>;

// The coarsest features alone, for PairMatcher::CountCoarseMatches.
PhotoFeaturesPtr CoarsestAlone(const PhotoFeatures& features);

// Decodes the blobs of a features_t (formats/formats.h). Fails if they are damaged, disagree on the
// number of keypoints, or hold a keypoint outside the image. cells: of the index.
Result<PhotoFeaturesPtr> DecodePhotoFeatures(int64_t image_id, const Camera& camera,
                                             const Bytes& keypoints, const Bytes& descriptors,
                                             const DescriptorCells* cells = nullptr);

}  // namespace skein
