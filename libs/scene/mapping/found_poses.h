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
  // The input of EstimatePose, as far as it can change. Bundle adjustment moves the visible points.
  struct Basis {
    Basis(const SceneMap& map, ImageId id, const VisiblePoints& visible,
          const TrialContext& context);
    auto Values() const {
      return std::tie(num_images, num_points, num_of_camera, is_camera_refined, camera_params,
                      matches_similar_place, needs_min_cells, point2D_idxs, xyz);
    }

    size_t num_images, num_points;  // of the map
    int num_of_camera;              // registered photos
    bool is_camera_refined;
    std::vector<double> camera_params;
    bool matches_similar_place, needs_min_cells;
    std::vector<Point2DIdx> point2D_idxs;  // of the visible points
    std::vector<Eigen::Vector3d> xyz;
  };
  struct Found {
    Basis basis;
    PoseEstimate estimate;
  };

  // Null if nothing is known, or if it rests on something else.
  const PoseEstimate* Find(ImageId id, const Basis& basis) const;

  std::map<ImageId, Found> before_, now_;
};

}  // namespace skein
