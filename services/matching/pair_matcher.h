#pragma once

// Two photos: putative matches and the geometry that verifies them, by a cascade that stops early.
//
//  1. A look at the 1,024 coarsest features of both photos, a sixty-fourth of the full product
//     (preemptive matching, Wu 2013).
//  2. If its matches verify the pair they give its geometry.
//  3. Guided matching (guided.h) of all features by that geometry, which is then refined.
//
// A pair without such a geometry, or with few inliers after step 3, is undecided: all its features
// are matched by cells (descriptor_cells.h), a fifth of the full product. Guided matching finds
// some support for a false geometry, too; that product does so less. A pair with few coarse matches
// is no pair without overlap: of 312 true pairs of south-building 11 have fewer than 8 among the
// 2,048 coarsest (docs/experiments/cascade.md).
//
// Photos with few features, or without cells, are matched in full.

#include "estimators/two_view_geometry.h"
#include "matching/guided.h"
#include "matching/kernel.h"
#include "matching/overlay.h"
#include "matching/photo_features.h"
#include "matching/two_view.h"

namespace skein {

struct PairMatcherOptions {
  MatchOptions matching;
  TwoViewOptions two_view;
  bool cascade = true;  // off: the full product of each pair

  Status Check() const;
};

struct PairResult {
  colmap::TwoViewGeometry geometry;  // as of EstimateTwoView, from the first photo to the second
  OverlayEvidence evidence;
  std::vector<char> stand_still;  // of geometry.inlier_matches (overlay.h)
  double product_s = 0;           // times on the clock, s: products of descriptors
  double guided_s = 0;
  double geometry_s = 0;
};

// Keeps working memory, so keep one a thread.
class PairMatcher {
 public:
  explicit PairMatcher(const PairMatcherOptions& options);  // throws std::invalid_argument

  // Deterministic by the photos' ids.
  PairResult Match(const PhotoFeatures& first, const PhotoFeatures& second);

 private:
  // Each adds its times to the result and replaces its geometry.
  void Verify(const PhotoFeatures& first, const PhotoFeatures& second,
              const colmap::FeatureMatches& matches, PairResult* result) const;
  void MatchAll(const PhotoFeatures& first, const PhotoFeatures& second, bool by_cells,
                PairResult* result);
  colmap::FeatureMatches MatchCoarsest(const PhotoFeatures& first, const PhotoFeatures& second);
  // Whether the look verifies the pair. If so result->geometry is of the coarse features.
  bool LookFirst(const PhotoFeatures& first, const PhotoFeatures& second, PairResult* result);
  // Of the inliers. Then the look tells nothing of what moves, and guided matching finds none of
  // it.
  bool MostStandStill(const PhotoFeatures& first, const PhotoFeatures& second,
                      const colmap::TwoViewGeometry& geometry) const;
  void MatchByCascade(const PhotoFeatures& first, const PhotoFeatures& second, PairResult* result);
  void MatchGuided(const PhotoFeatures& first, const PhotoFeatures& second, PairResult* result);

  PairMatcherOptions options_;
  DescriptorMatcher matcher_;
  GuidedMatcher guided_;
};

// Seed of a pair's robust estimation.
uint32_t PairSeed(int64_t image_id, int64_t other_id);

}  // namespace skein
