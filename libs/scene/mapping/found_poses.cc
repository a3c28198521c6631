#include "mapping/found_poses.h"

#include <utility>

namespace skein {

FoundPoses::Basis::Basis(const SceneMap& map, ImageId id, const VisiblePoints& visible,
                         const TrialContext& context)
    : num_images(map.reconstruction().NumRegImages()),
      num_points(map.reconstruction().NumPoints3D()),
      matches_similar_place(context.matches_similar_place),
      needs_min_cells(context.needs_min_cells),
      point2D_idxs(visible.point2D_idxs),
      xyz(visible.xyz) {
  const CameraId camera = map.reconstruction().Image(id).CameraId();
  num_of_camera = map.camera_state(camera).num_registered;
  is_camera_refined = map.camera_state(camera).refined;
  camera_params = map.reconstruction().Camera(camera).Params();
}

void FoundPoses::BeginNext() { before_ = std::exchange(now_, {}); }

const PoseEstimate* FoundPoses::Find(ImageId id, const Basis& basis) const {
  const auto found = before_.find(id);
  const bool is_same = found != before_.end() && found->second.basis.Values() == basis.Values();
  return is_same ? &found->second.estimate : nullptr;
}

PoseEstimate FoundPoses::Estimate(const SceneMap& map, ImageId id, const VisiblePoints& visible,
                                  const TrialContext& context) {
  Basis basis(map, id, visible, context);
  const PoseEstimate* known = Find(id, basis);
  Found found{std::move(basis), known ? *known : EstimatePose(map, id, visible, context)};
  return now_.insert_or_assign(id, std::move(found)).first->second.estimate;
}

bool FoundPoses::Knows(const SceneMap& map, ImageId id, const VisiblePoints& visible,
                       const TrialContext& context) const {
  if (before_.count(id) == 0) return false;
  const PoseEstimate* known = Find(id, Basis(map, id, visible, context));
  return known != nullptr && known->ok;
}

}  // namespace skein
