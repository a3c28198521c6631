#pragma once

#include <map>
#include <tuple>
#include <vector>

#include "mapping/registration.h"

namespace skein {

// Pose estimates of guests, each with what it rests on. A merge's target takes in guests of the
// source twice: when the merger compares the two submaps, and when it absorbs. As long as the map
// has not changed, an estimate is taken from the comparison before.
class FoundPoses {
 public:
  // A comparison begins: the estimates since the last call are those of the comparison before.
  void BeginNext();

  // As EstimatePose. The estimate of the comparison before is taken if it rests on the same.
  PoseEstimate Estimate(const SceneMap& map, ImageId id, const VisiblePoints& visible,
                        const TrialContext& context);
  // Whether that comparison found a pose which rests on the same.
  bool Knows(const SceneMap& map, ImageId id, const VisiblePoints& visible,
             const TrialContext& context) const;

 private:
  // The input of EstimatePose, as far as it can change:
  //   map        numbers of images and points
  //   camera     registered photos, whether it is refined, parameters
  //   context    both flags
  //   visible    keypoints and positions of the points, which bundle adjustment moves
  using Basis = std::tuple<size_t, size_t, int, bool, std::vector<double>, bool, bool,
                           std::vector<Point2DIdx>, std::vector<Eigen::Vector3d>>;
  struct Found {
    Basis basis;
    PoseEstimate estimate;
  };

  static Basis BasisOf(const SceneMap& map, ImageId id, const VisiblePoints& visible,
                       const TrialContext& context);
  // Null if nothing is known, or if it rests on something else.
  const PoseEstimate* Find(ImageId id, const Basis& basis) const;

  std::map<ImageId, Found> before_, now_;
};

}  // namespace skein
