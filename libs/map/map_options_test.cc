#include <gtest/gtest.h>

#include "map/filters.h"
#include "map/retriangulation.h"
#include "testing/test_options.h"

namespace skein::map_options_test {

TEST(FilterOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<FilterOptions>({
      {"max_reprojection_error_px", [](auto* o) { o->max_reprojection_error_px = 0; }},
      {"min_triangulation_angle_deg", [](auto* o) { o->min_triangulation_angle_deg = -1; }},
  });
}

TEST(RetriangulationOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<RetriangulationOptions>({
      {"min_ratio", [](auto* o) { o->min_ratio = 2; }},
      {"max_angle_error_deg", [](auto* o) { o->max_angle_error_deg = -1; }},
      {"triangulation", [](auto* o) { o->triangulation.min_angle = -1; }},
  });
}

}  // namespace skein::map_options_test
