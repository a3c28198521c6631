#pragma once

#include "disambiguation/similar_structures.h"

namespace skein {

// Earlier findings on a photo that decide how strictly its pose is judged.
struct TrialContext {
  // The photo, or one that it matches, was found to show a visually similar place: it is judged by
  // missing cells, too.
  bool matches_similar_place = false;
  bool needs_min_cells = false;  // at least `min_cells` must count
  int min_cells = kMinCells;     // SubmapOptions::min_cells
};

}  // namespace skein
