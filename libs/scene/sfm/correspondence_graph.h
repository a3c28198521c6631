#pragma once

#include <cstddef>
#include <unordered_map>
#include <vector>

#include "sfm/feature_match.h"
#include "sfm/ids.h"

namespace skein {

// Matched keypoints of all images, by keypoint: a match is found from both of its ends. Ids and
// indices that are not there throw std::out_of_range.
class CorrespondenceGraph {
 public:
  // The keypoint at the other end of a match.
  struct Correspondence {
    ImageId image_id = kInvalidImageId;
    Point2DIdx point2D_idx = kInvalidPoint2DIdx;
  };

  // Throws std::logic_error if the image is there.
  void AddImage(ImageId id, size_t num_keypoints);
  // The pair's matches, once. Matches are one-to-one: no keypoint has two of them.
  void AddCorrespondences(ImageId id1, ImageId id2, const FeatureMatches& matches);

  // In the order in which the pairs were added.
  const std::vector<Correspondence>& FindCorrespondences(ImageId id, Point2DIdx index) const {
    return images_.at(id).at(index);
  }
  // Whether the keypoint has one match, and that is the other keypoint's only one, too.
  bool IsTwoViewObservation(ImageId id, Point2DIdx index) const;

 private:
  using OfImage = std::vector<std::vector<Correspondence>>;  // by keypoint

  std::unordered_map<ImageId, OfImage> images_;
};

}  // namespace skein
