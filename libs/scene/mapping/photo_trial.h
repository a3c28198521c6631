#pragma once

#include <optional>
#include <vector>

#include "mapping/found_poses.h"
#include "mapping/placement.h"

namespace skein {

// Whether a photo on trial stays in the map.
struct Verdict {
  enum class Decision { kKeep, kUndo, kKeepAfterWithdrawing };
  Decision decision = Decision::kKeep;
  Refusal refusal;                // of kUndo
  std::vector<ImageId> withdraw;  // of kKeepAfterWithdrawing: photos that stand in the wrong place
};

// The registration of one photo, step by step: correspondences, pose, triangulation and refinement,
// verdict. No other photo moves. Bundle adjustment of the photos around it comes after the verdict.
class PhotoTrial {
 public:
  // `map` must outlive this.
  PhotoTrial(const TrialContext& context, ImageId id, SceneMap* map);

  // 2D-3D correspondences and an absolute pose from them. Changes nothing in the map. False if
  // there is none; estimate().refusal says why. `found`: of guests; null: none is known.
  bool FindPose(FoundPoses* found = nullptr);
  // Registers the photo, triangulates its matches, refines its pose with its points.
  void Place();
  // After Place().
  Verdict Judge() const;
  // Puts the map back to what it was.
  void Undo();

  ImageId id() const { return id_; }
  const PoseEstimate& estimate() const { return estimate_; }
  double register_s() const { return register_s_; }        // FindPose
  double triangulate_s() const { return triangulate_s_; }  // Place
  double total_s() const;                                  // since the beginning

 private:
  Verdict JudgeAgainstNeighbours() const;

  const TrialContext context_;
  const ImageId id_;
  SceneMap& map_;
  VisiblePoints visible_;
  PoseEstimate estimate_;
  std::optional<Placement> placement_;
  const double start_s_;
  double register_s_ = 0, triangulate_s_ = 0;
};

}  // namespace skein
