#include <gtest/gtest.h>

#include "disambiguation/similar_structures.h"
#include "testing/test_options.h"

namespace skein::similar_structures_options_test {

TEST(SimilarStructuresOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<SimilarStructuresOptions>({
      {"num_columns", [](auto* o) { o->num_columns = 0; }},
      {"num_rows", [](auto* o) { o->num_rows = 0; }},
      {"min_points", [](auto* o) { o->min_points = 0; }},
      {"max_view_angle_deg", [](auto* o) { o->max_view_angle_deg = 0; }},
      {"max_distance_ratio", [](auto* o) { o->max_distance_ratio = 0.9; }},
      {"min_own_points", [](auto* o) { o->min_own_points = 0; }},
      {"max_depth_ratio", [](auto* o) { o->max_depth_ratio = 0; }},
      {"max_different_share", [](auto* o) { o->max_different_share = 1.1; }},
      {"max_missing_share", [](auto* o) { o->max_missing_share = -0.1; }},
      {"min_cells", [](auto* o) { o->min_cells = 0; }},
      {"min_different_cells", [](auto* o) { o->min_different_cells = 0; }},
      {"min_missing_cells", [](auto* o) { o->min_missing_cells = 0; }},
      {"min_pair_cells", [](auto* o) { o->min_pair_cells = 0; }},
      {"max_neighbours", [](auto* o) { o->max_neighbours = 0; }},
  });
}

}  // namespace skein::similar_structures_options_test
