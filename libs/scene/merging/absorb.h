// Absorbs one submap into another: fuse, adjust the seam, verify. Pure: works on one copy, so that
// a merge which fails leaves nothing behind.
#pragma once

#include <set>

#include "core/result.h"
#include "disambiguation/similar_structures.h"
#include "geometry/sim3_ransac.h"
#include "merging/fuse.h"
#include "merging/merge_checks.h"
#include "merging/seam_bundle.h"
#include "sfm/reconstruction.h"

namespace skein {

struct AbsorbOptions {
  Sim3Options sim3;
  int min_shared_images = 3;  // agreeing, before and after the adjustment
  SeamIntrinsics intrinsics;
  // False: for a merge that was verified before and is carried out again.
  bool verify = true;

  Status Check() const;
};

// With less than three shared photos all of them must agree, each with far more of its points.
void AdaptToFewImages(int num_shared_images, Sim3Options* options);

struct AbsorbResult {
  Status status;
  bool shows_another_place = false;  // the merge failed because the submaps show different places
  Reconstruction merged;             // only if status is ok
  FuseResult fused;
  BundleSummary bundle;
  // Photos whose camera has impossible intrinsics in its submap (limits.h), so that their poses
  // mean nothing. Such a camera vetoes no merge: the merged model is without its photos.
  std::set<ImageId> left_out;
  std::set<ImageId> seam;  // adjusted images
  Residuals target_before, target_after;
  Residuals source_before, source_after;
};

// Throws std::invalid_argument on nonsensical options; every failure of the merge is a status.
// `source` is in its own frame; both models keep COLMAP's conventions. Either may hold photos that
// are not registered; the merged model holds registered ones alone.
AbsorbResult Absorb(const Reconstruction& target, const Reconstruction& source,
                    const Similarity& target_from_source, const AbsorbOptions& options);

}  // namespace skein
