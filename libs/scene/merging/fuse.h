// Puts two models into one frame and one structure, before any adjustment.
#pragma once

#include <map>
#include <set>
#include <vector>

#include "core/result.h"
#include "geometry/sim3_ransac.h"
#include "sfm/reconstruction.h"

namespace skein {

// Ids of the registered photos.
std::set<ImageId> RegisteredIn(const Reconstruction& model);

// The photos registered in both models, by id, with the points that both see through them. Photos
// with an invalid camera are left out.
std::vector<SharedPhoto> SharedPhotosOf(const Reconstruction& source, const Reconstruction& target);

// Photos and points of the two models by outcome.
struct FuseResult {
  Status status;                  // an error: why the models cannot be fused
  std::set<ImageId> agreeing;     // shared photos whose two poses agree: they are the seam
  std::set<ImageId> kept_target;  // shared photos that disagree: the target's pose stays
  std::set<ImageId> kept_source;  // the same, the source's pose stays
  std::set<ImageId> added;        // photos that only the source had registered
  int num_common_points = 0;      // points of the target that tracks of the source meet in a photo
  int num_fused_points = 0;       // of these, with one point now
  int num_added_points = 0;       // points of the source without any in the target
};

// Fuses `source` into `merged`, which is a copy of the target.
//  - A shared photo keeps the target's pose. If the poses disagree, the submap with more
//    observations of the photo keeps its pose, and the other's observations are removed.
//  - Tracks that meet in one (image, point2D) become one when every observation reprojects within
//    the limit of `options`, with the intrinsics of its submap.
//  - A camera of both submaps starts the adjustment with the model and the intrinsics of the submap
//    with more photos of it.
// COLMAP 3.8's Reconstruction::Merge takes images that merely exist for common ones, and keeps only
// the target's intrinsics.
FuseResult FuseModels(const Reconstruction& source, const Similarity& target_from_source,
                      const Sim3Options& options, Reconstruction* merged);

}  // namespace skein
