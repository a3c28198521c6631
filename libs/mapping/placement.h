#pragma once

#include <vector>

#include "bundle/bundle.h"
#include "mapping/registration.h"

namespace skein {

// A photo at the pose that was estimated for it, on trial. Such a pose hangs on points that few
// photos have seen, so it can be off by more than the verified matches allow although it is right.
// The photo is therefore registered, its matches triangulated, and its pose refined with its
// points before anything is asked of it; no other photo moves.
class Placement {
 public:
  // Registers the photo with the estimate. The map must outlive this.
  Placement(const PoseEstimate& estimate, const VisiblePoints& visible, ImageId image_id,
            const colmap::IncrementalTriangulator::Options& triangulation, SceneMap* map);

  // Whether enough of the photo's verified matches with registered photos, triangulated or not,
  // agree with its pose: a few points in one corner can fit a wrong one, the many matches around
  // them don't.
  bool AgreesWithMatches(const RegistrationOptions& options) const;

  // How well the refined pose is determined.
  const PoseSigmas& sigmas() const { return sigmas_; }

  // Puts the map back to what it was.
  void Undo();

 private:
  const ImageId image_id_;
  SceneMap& map_;
  std::vector<double> params_before_;  // of its camera
  PoseSigmas sigmas_;
  Bundle before_;  // its points before the refinement
};

}  // namespace skein
