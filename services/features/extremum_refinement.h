#pragma once

#include <optional>

#include "features/scale_space.h"

namespace skein {

// How far a refined extremum may lie from the one found, pixels: so many rows around it are held.
constexpr int kMaxRefinementSteps = 2;

// Rows of the differences of Gaussians around an extremum, grey levels.
struct DogRows {
  // Rows y - kMaxRefinementSteps - 1 .. y + kMaxRefinementSteps + 1; columns of the tile.
  const float* rows[kDogLevels][2 * kMaxRefinementSteps + 3];
};

struct SubpixelStep {
  float x = 0, y = 0, s = 0;  // s: layers
};

struct RefinedExtremum {
  int dx = 0, dy = 0;  // pixels from where it was found
  int layer = 0;
  SubpixelStep step;   // from there, below half a pixel and layer
  float contrast = 0;  // signed, grey levels
};

// Lowe 2004, section 4 (Brown and Lowe 2002): the extremum of a quadratic through the 3 x 3 x 3
// values around it, moved to the next pixel while it lies nearer to that. nullopt if it leaves the
// rows or the layers, is too low, or lies on an edge (section 4.1). `min_contrast`: grey levels.
std::optional<RefinedExtremum> Refine(const DogRows& dog, const FoundExtremum& found,
                                      double min_contrast, double edge_threshold);

}  // namespace skein
