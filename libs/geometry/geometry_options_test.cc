#include <gtest/gtest.h>

#include "geometry/georeference.h"
#include "geometry/sim3_ransac.h"
#include "testing/test_options.h"

namespace skein::geometry_options_test {

TEST(GeoreferenceOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<GeoreferenceOptions>({
      {"min_inliers", [](auto* o) { o->min_inliers = 2; }},
      {"num_trials", [](auto* o) { o->num_trials = 0; }},
      {"min_sigma_m", [](auto* o) { o->min_sigma_m = 0; }},
      {"min_horizontal_gain", [](auto* o) { o->min_horizontal_gain = 2; }},
      {"max_horizontal_loss", [](auto* o) { o->max_horizontal_loss = 0.5; }},
      {"max_vertical_ratio", [](auto* o) { o->max_vertical_ratio = -1; }},
      {"max_tilt_deg", [](auto* o) { o->max_tilt_deg = -1; }},
      {"max_rotation_deg", [](auto* o) { o->max_rotation_deg = 0; }},
      {"max_scale", [](auto* o) { o->max_scale = 0; }},
  });
}

TEST(Sim3Options, RefusesWhatMakesNoSense) {
  ExpectChecked<Sim3Options>({
      {"min_inlier_ratio", [](auto* o) { o->min_inlier_ratio = 0; }},
      {"max_reprojection_error", [](auto* o) { o->max_reprojection_error_px = 0; }},
      {"trials", [](auto* o) { o->num_trials = 0; }},
      {"min_inlier_images", [](auto* o) { o->min_inlier_images = 0; }},
      {"min_common_points", [](auto* o) { o->min_common_points = 0; }},
      {"max_scored_points", [](auto* o) { o->max_scored_points = 0; }},
  });
}

}  // namespace skein::geometry_options_test
