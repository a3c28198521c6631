#pragma once

#include <vector>

#include "bundle/bundle.h"
#include "mapping/registration.h"

namespace skein {

// A photo at the pose that was estimated for it, on trial. That pose comes from few points and can
// be off by more than the verified matches allow, although it is right. So the photo is registered,
// its matches triangulated and its pose refined before it is judged. No other photo moves.
class Placement {
 public:
  // Registers the photo with the estimate. The map must outlive this.
  Placement(const PoseEstimate& estimate, const VisiblePoints& visible, ImageId image_id,
            SceneMap* map);

  // Whether enough of the photo's verified matches with registered photos agree with its pose,
  // triangulated or not. A few points in one corner can fit a wrong pose; the many matches around
  // them don't.
  bool AgreesWithMatches() const;

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
