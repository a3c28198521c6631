#include "mapping/placement.h"

#include "map/bundle_builder.h"

namespace skein {
namespace {

// The photo and its points are free, but for those with long tracks; the points' other observers
// are held.
Bundle BundleOfPhoto(const SceneMap& map, ImageId image_id) {
  BundleRequest request;
  request.free = {image_id};
  const std::vector<Point3DId> points = PointsSeenBy(map, request.free);
  request.complete_points = WithoutLongTracks(map, points);
  request.points = Without(points, request.complete_points);
  request.hold_open_points = true;
  return BuildBundle(map, request);
}

}  // namespace

Placement::Placement(const PoseEstimate& estimate, const VisiblePoints& visible, ImageId image_id,
                     SceneMap* map)
    : image_id_(image_id), map_(*map) {
  const Reconstruction& reconstruction = map->reconstruction();
  params_before_ = reconstruction.Camera(reconstruction.Image(image_id).CameraId()).Params();
  RegisterWithPose(estimate, visible, image_id, map);
  map->TriangulateImage(image_id);
  before_ = BundleOfPhoto(*map, image_id);
  Bundle bundle = before_;
  if (SolveBundle({}, &bundle).usable) ApplyBundle(bundle, map);
  sigmas_ = SigmasOfFirstPose(bundle);
}

bool Placement::AgreesWithMatches() const {
  return EpipolarVotes(map_, image_id_).AgreeingShare() >= kMinEpipolarShare;
}

void Placement::Undo() {
  ApplyBundle(before_, &map_);
  map_.Deregister(image_id_);
  map_.SetCamera(map_.reconstruction().Image(image_id_).CameraId(), params_before_);
}

}  // namespace skein
