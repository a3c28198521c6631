#pragma once

#include "bundle/bundle.h"
#include "sfm/reconstruction.h"

namespace skein {

// An image's pose as a bundle has it.
void GetPose(const Image& image, BundlePose* pose);
void SetPose(const BundlePose& pose, Image* image);

// Puts the refined poses, points and parameters into the model they were built from. Images that
// are no longer registered, points that are gone and cameras of another model by now are passed
// over.
void ApplyBundle(const Bundle& bundle, Reconstruction* model);

// Whether the model has the image, and a pose of it.
bool IsRegisteredIn(const Reconstruction& model, ImageId id);

// Whether focal length and distortion are within limits.h.
bool HasPossibleIntrinsics(const Camera& camera);

// SolveBundle, of a bundle that was built from `model`. A camera whose refined intrinsics are
// impossible keeps those that it came with, and the rest is solved again.
BundleSummary SolveWithPossibleIntrinsics(const BundleOptions& options, const Reconstruction& model,
                                          Bundle* bundle);

}  // namespace skein
