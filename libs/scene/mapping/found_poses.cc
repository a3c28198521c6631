#include "mapping/found_poses.h"

#include <utility>

namespace skein {

FoundPoses::Basis FoundPoses::BasisOf(const SceneMap& map, ImageId id, const VisiblePoints& visible,
                                      const TrialContext& context) {
  const Reconstruction& model = map.reconstruction();
  const CameraId camera = model.Image(id).CameraId();
  const CameraState& state = map.camera_state(camera);
  return {model.NumRegImages(),    model.NumPoints3D(),           state.num_registered,
          state.refined,           model.Camera(camera).Params(), context.matches_similar_place,
          context.needs_min_cells, visible.point2D_idxs,          visible.xyz};
}

void FoundPoses::BeginNext() { before_ = std::exchange(now_, {}); }

const PoseEstimate* FoundPoses::Find(ImageId id, const Basis& basis) const {
  const auto found = before_.find(id);
  const bool is_same = found != before_.end() && found->second.basis == basis;
  return is_same ? &found->second.estimate : nullptr;
}

PoseEstimate FoundPoses::Estimate(const SceneMap& map, ImageId id, const VisiblePoints& visible,
                                  const TrialContext& context) {
  Basis basis = BasisOf(map, id, visible, context);
  const PoseEstimate* known = Find(id, basis);
  Found found{std::move(basis), known ? *known : EstimatePose(map, id, visible, context)};
  return now_.insert_or_assign(id, std::move(found)).first->second.estimate;
}

bool FoundPoses::Knows(const SceneMap& map, ImageId id, const VisiblePoints& visible,
                       const TrialContext& context) const {
  if (before_.count(id) == 0) return false;
  const PoseEstimate* known = Find(id, BasisOf(map, id, visible, context));
  return known != nullptr && known->ok;
}

}  // namespace skein
