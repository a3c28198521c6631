// Bundle adjustment for the seam of a merge: the whole of a small model, the images around the seam
// of a large one.
#pragma once

#include <set>

#include "bundle/bundle.h"
#include "sfm/reconstruction.h"

namespace skein {

constexpr int kMaxWholeImages = 150;    // of a model that is adjusted as a whole
constexpr int kMaxSeamNeighbours = 60;  // of the shared images of a larger one

// The images that a merge adjusts: all of a model up to `max_whole_images`; else the agreeing
// shared images and the `max_neighbours` with most points in common with them.
std::set<ImageId> SeamOf(const std::set<ImageId>& agreeing, const Reconstruction& merged,
                         int max_whole_images = kMaxWholeImages,
                         int max_neighbours = kMaxSeamNeighbours);

// Conditions on cameras to be refined: enough photos, and none outside of the free images.
struct SeamIntrinsics {
  int min_images = 6;        // free ones of a camera
  std::set<CameraId> fixed;  // known: never refined
};

// Refines poses of `free_images`, all points they see, and intrinsics. Other images that see those
// points hold the frame; where there are none, it moves as little as it must. A camera is refined
// if
//  - it is not fixed,
//  - `intrinsics.min_images` of the free images are its photos, and
//  - none of its photos is outside of them: a window alone never decides about a shared camera.
// All of `free_images` must be registered. Loss: soft L1 at 1 px. Changes nothing unless usable.
// Solved by SolveWithPossibleIntrinsics.
BundleSummary AdjustSeam(const std::set<ImageId>& free_images, const SeamIntrinsics& intrinsics,
                         Reconstruction* model);

}  // namespace skein
