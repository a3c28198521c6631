#pragma once

// Two photos: putative matches and the geometry that verifies them, by a cascade that stops early.
//
//  1. A look at the 1,024 coarsest features of both photos, a sixty-fourth of the full product
//     (preemptive matching, Wu 2013).
//  2. If its matches verify the pair, all features are matched by close cells (descriptor_cells.h),
//     a tenth of the full product. If a geometry explains half of these matches, it is the pair's.
//  3. Otherwise all features are matched by near cells, a fifth of the full product. Near cells
//     miss one match of 200, close cells one of 30 of a weak pair.
//
// The geometry is searched among the matches of all features, as the coarsest may have another one
// where structures repeat. The ratio test compares with all features that look alike. Matching
// along the epipolar lines compares with those near the line alone: where structures repeat its
// further matches are false or less exact (docs/experiments/cascade.md). A pair with few coarse
// matches is no pair without overlap: of 312 true pairs of south-building 11 have fewer than 8
// among the 2,048 coarsest.
//
// Photos with few features, or without cells, are matched in full.

#include "matching/kernel.h"
#include "matching/overlay.h"
#include "matching/photo_features.h"
#include "matching/two_view.h"
#include "sfm/two_view_geometry.h"

namespace skein {

struct PairResult {
  TwoViewGeometry geometry;  // as of EstimateTwoView, from the first photo to the second
  OverlayEvidence evidence;
  std::vector<char> stand_still;  // of geometry.inlier_matches (overlay.h)
  bool by_close_cells = false;    // the cascade ended with its step 2
  double product_s = 0;           // times on the clock, s: products of descriptors
  double geometry_s = 0;
};

// Keeps working memory, so keep one a thread.
class PairMatcher {
 public:
  // `cascade`: false takes the full product of each pair. Throws std::invalid_argument for a kernel
  // that is not supported here.
  explicit PairMatcher(bool cascade = true, KernelVersion kernel = FastestKernel());

  // Deterministic by the photos' ids.
  PairResult Match(const PhotoFeatures& first, const PhotoFeatures& second);
  // Mutual matches of the coarsest features alone, verified by no geometry.
  int CountCoarseMatches(const PhotoFeatures& first, const PhotoFeatures& second);

 private:
  // Each adds its times to the result and replaces its geometry.
  void Verify(const PhotoFeatures& first, const PhotoFeatures& second,
              const FeatureMatches& matches, PairResult* result) const;
  void MatchInFull(const PhotoFeatures& first, const PhotoFeatures& second, PairResult* result);
  // `others`: of the second photo's cells.
  FeatureMatches MatchByCells(const PhotoFeatures& first, const PhotoFeatures& second,
                              const CellLists& others, PairResult* result);
  FeatureMatches MatchCoarsest(const PhotoFeatures& first, const PhotoFeatures& second);
  // Whether the look verifies the pair.
  bool LookFirst(const PhotoFeatures& first, const PhotoFeatures& second, PairResult* result);
  // Whether half of the matches by close cells agree.
  bool MatchByCloseCells(const PhotoFeatures& first, const PhotoFeatures& second,
                         PairResult* result);

  const bool cascade_;
  DescriptorMatcher matcher_;
};

// Seed of a pair's robust estimation.
uint32_t PairSeed(int64_t image_id, int64_t other_id);

}  // namespace skein
