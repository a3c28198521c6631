#pragma once

#include "bundle/bundle.h"
#include "map/scene_map.h"

namespace skein {

// The name for SubmapOptions::camera_model by which each camera gets the model that its photos call
// for.
constexpr char kModelByEvidence[] = "auto";
// The model that its cameras start with.
constexpr char kFirstModel[] = "SIMPLE_RADIAL";

// A lens may distort more than one radial term can tell, and photos may be squeezed. Then poses and
// points give way: the map bends, and still fits well. So the map is adjusted with OPENCV, too,
// and if that is better for a camera, with OPENCV_FISHEYE. The model with the least Bayesian
// information criterion stays (Schwarz, Estimating the dimension of a model, 1978):
//
//   BIC = n ln C + k ln n
//
// C: the sum of the camera's robust errors after the adjustment, k: the parameters that are
// refined, n: its observations, of which an image has kIndependentObservations at most
// (bundle_builder.h). The models are compared by a part of the map (BuildBundleOfSome), then the
// map is adjusted with the chosen ones.
//
// Pixels are square: two equal focal lengths stay equal (BundleCamera::square_pixels). Photos are
// squeezed if a free ratio leaves less than half of the errors. A smaller gain is of something
// else: a rolling shutter, e.g., or the ground under parallel lines of flight.
//
// Cameras of fewer than three photos, known ones, and those of single photos (own_cameras.h) stay
// as they are, and those with as many photos as at the last choice. True if a camera has another
// model now, with the poses and points that were found along.
bool ChooseCameraModels(const BundleOptions& options, SceneMap* map);

}  // namespace skein
