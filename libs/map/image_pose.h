#pragma once

#include "base/reconstruction.h"
#include "bundle/bundle.h"

namespace skein {

// A pose in COLMAP's and in our form.
void GetPose(const colmap::Image& image, BundlePose* pose);
void SetPose(const BundlePose& pose, colmap::Image* image);

// Puts the refined poses, points and parameters into the model they were built from. Images that
// are no longer registered and points that are gone are passed over.
void ApplyBundle(const Bundle& bundle, colmap::Reconstruction* model);

// Whether the model has the image, and a pose of it.
bool IsRegisteredIn(const colmap::Reconstruction& model, colmap::image_t id);

// Whether focal length and distortion are within limits.h.
bool HasPossibleIntrinsics(const colmap::Camera& camera);

}  // namespace skein
