#include "mapper/placement.h"

#include "mapper/bundle_builder.h"

namespace skein {
namespace {

// The photo and its points are free, the points' other observers held.
Bundle BundleOfPhoto(const SceneMap& map, ImageId image_id) {
  BundleRequest request;
  request.free = {image_id};
  request.points = PointsSeenBy(map, request.free);
  request.held = ObserversOf(map, request.points);
  return BuildBundle(map, request);
}

}  // namespace

Placement::Placement(const PoseEstimate& estimate, const VisiblePoints& visible, ImageId image_id,
                     const colmap::IncrementalTriangulator::Options& triangulation, SceneMap* map)
    : image_id_(image_id), map_(*map) {
  colmap::Reconstruction& reconstruction = map->reconstruction();
  params_before_ = reconstruction.Camera(reconstruction.Image(image_id).CameraId()).Params();
  RegisterWithPose(estimate, visible, image_id, map);
  map->triangulator().TriangulateImage(triangulation, image_id);
  before_ = BundleOfPhoto(*map, image_id);
  Bundle bundle = before_;
  if (SolveBundle({}, &bundle).usable) ApplyBundle(bundle, map);
  sigmas_ = SigmasOfFirstPose(bundle);
}

bool Placement::AgreesWithMatches(const RegistrationOptions& options) const {
  return EpipolarVotes(map_, image_id_, options.max_epipolar_error_px).AgreeingShare() >=
         options.min_epipolar_share;
}

void Placement::Undo() {
  ApplyBundle(before_, &map_);
  map_.Deregister(image_id_);
  colmap::Reconstruction& reconstruction = map_.reconstruction();
  reconstruction.Camera(reconstruction.Image(image_id_).CameraId()).SetParams(params_before_);
}

}  // namespace skein
