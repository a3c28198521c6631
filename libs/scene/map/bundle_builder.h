#pragma once

#include <vector>

#include "bundle/bundle.h"
#include "map/image_pose.h"
#include "map/scene_map.h"

namespace skein {

// Neighbours share the errors of an image's observations (localisation, lens, mismatches). More
// observations than this weigh as this many against a camera's prior, or for its model.
constexpr double kIndependentObservations = 100;
constexpr size_t kImagesOfSome = 200;
constexpr int kObservationsOfSome = 500;

// Part of a map that a bundle holds.
struct BundleRequest {
  std::vector<ImageId> free;             // poses to refine
  std::vector<PoseStiffness> stiffness;  // of `free`; empty: plain least squares
  std::vector<ImageId> held;      // constant poses, whose observations count; `free` comes first
  std::vector<Point3DId> points;  // to refine; those with < 2 observations in it are left out
  // If true, those of `points` that other images than `free` and `held` see are constant, as in
  // COLMAP's local BA.
  bool hold_open_points = false;
  // To refine with the observations of all images, none of them among `points`. Images that are not
  // in the bundle get constant poses.
  std::vector<Point3DId> complete_points;
  bool refine_cameras = false;  // focal length; distortion from three registered photos on
};

// A bundle of a part of the map, priors scaled; only registered images count.
Bundle BuildBundle(const SceneMap& map, const BundleRequest& request);

// All registered images and points.
Bundle BuildGlobalBundle(const SceneMap& map, bool refine_cameras);

// Enough of a map to compare models of its cameras. Images: kImagesOfSome at most, nearest along
// verified pairs to the first of each camera. Points: by chance, so many that each image has
// kObservationsOfSome observations, or all of its own.
Bundle BuildBundleOfSome(const SceneMap& map, bool refine_cameras);
// Its images.
std::vector<ImageId> ImagesOfSome(const SceneMap& map);

// Puts the priors of cameras in units of the observations, which weigh as if their standard
// deviation were 1 px: divides each sigma by s sqrt(max(1, m / k)). s: standard deviation of the
// bundle's errors, 1 px at most, as the solver's loss weighs larger ones less. m: observations an
// image of the camera. k: kIndependentObservations. Without k, thousands of observations in a few
// images of a small angle drive the focal length away. Without s, a prior that is 3 % off shifts a
// map of sharp photos. Priors stay as they are if no camera is refined: none counts then.
void ScalePriors(Bundle* bundle);

// To the map it was built from, as image_pose.h tells.
void ApplyBundle(const Bundle& bundle, SceneMap* map);

// The camera with its weak priors: focal length 10 % (EXIF) or 30 %, distortion 0.1.
BundleCamera MakeBundleCamera(const SceneMap& map, CameraId id, bool refine_focal,
                              bool refine_distortion);

}  // namespace skein
