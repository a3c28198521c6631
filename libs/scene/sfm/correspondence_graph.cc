#include "sfm/correspondence_graph.h"

#include <stdexcept>

namespace skein {

void CorrespondenceGraph::AddImage(ImageId id, size_t num_keypoints) {
  if (!images_.emplace(id, OfImage(num_keypoints)).second) {
    throw std::logic_error("an image twice");
  }
}

void CorrespondenceGraph::AddCorrespondences(ImageId id1, ImageId id2,
                                             const FeatureMatches& matches) {
  OfImage& image1 = images_.at(id1);
  OfImage& image2 = images_.at(id2);
  for (const FeatureMatch& match : matches) {
    image1.at(match.point2D_idx1).push_back({id2, match.point2D_idx2});
    image2.at(match.point2D_idx2).push_back({id1, match.point2D_idx1});
  }
}

bool CorrespondenceGraph::IsTwoViewObservation(ImageId id, Point2DIdx index) const {
  const std::vector<Correspondence>& own = FindCorrespondences(id, index);
  return own.size() == 1 &&
         FindCorrespondences(own.front().image_id, own.front().point2D_idx).size() == 1;
}

}  // namespace skein
