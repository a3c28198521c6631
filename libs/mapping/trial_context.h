#pragma once

namespace skein {

// What is known of a photo before its pose is estimated.
struct TrialContext {
  // It, or a photo that it matches, was found to be of a visually similar place. Then it is judged
  // by missing cells, too.
  bool matches_similar_place = false;
  bool needs_min_cells = false;  // at least SimilarStructuresOptions::min_cells must count
  bool takes_ambiguous = false;  // a pose is taken although the photo's points agree on another
};

}  // namespace skein
