#pragma once

#include "bundle/bundle.h"
#include "core/limits.h"
#include "map/scene_map.h"
#include "mapping/misplaced.h"

namespace skein {

// Points that a photo must observe, and that must tie a part to the rest (ThinnestCut). With fewer,
// chance can have tied them there.
constexpr int kMinTie = 15;

// How well the observations of a map determine its shape.
struct ShapeCheck {
  // Expected position error, RMS over the photos, as a fraction of the extent (the largest distance
  // between two photos): what `skein evaluate` measures against a truth. At most 1; 1 if a photo is
  // not determined at all. 0: not known. LoosestMode::expected_error times 4. Photos in a wrong
  // place are not in it, unless fewer than kMinTie points tie their part to the rest: then it is 1.
  double position_sigma = 0;
  // The photos between which the loosest mode bends (WeakestCut), or between which the tie is too
  // thin (ThinnestCut); 0: none.
  ImageId loose_image = 0, anchor_image = 0;
  int num_loose_images = 0;  // on the side of loose_image
};

// Shape of a whole map after global BA. `bundle` has all its photos, none of them constant. Costs a
// decomposition of the reduced system, as the first step of the BA did, and 21 solutions with it.
ShapeCheck CheckShape(const Bundle& bundle, int num_threads = 1);

// Matches of verified pairs of registered photos that contradict the poses. Matches are counted,
// not pairs: of a right map many pairs of similar structures contradict, by few matches each.
struct MatchCheck {
  int num_matches = 0;        // of which both keypoints have points
  int num_contradicting = 0;  // of the pairs that contradict
  // The pair with most contradicting matches, and these; 0: none.
  ImageId strongest1 = 0, strongest2 = 0;
  int num_of_strongest = 0;
};

// A pair contradicts as two groups of photos do (misplaced.h): more matches contradict than agree,
// by kMinContradiction at least. A torn pair contradicts, too. Visits all pairs.
MatchCheck CheckMatches(const SceneMap& map);

// Errors of a map that its residuals don't show.
struct ModelCheck {
  ShapeCheck shape;
  MatchCheck matches;
};

}  // namespace skein
