#include <gtest/gtest.h>

#include "mapping/initial_pair.h"
#include "mapping/submap_options.h"
#include "testing/test_options.h"

namespace skein::mapping_options_test {

TEST(InitialPairOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<InitialPairOptions>({
      {"min_num_inliers", [](auto* o) { o->min_num_inliers = 0; }},
      {"min_triangulation_angle_deg", [](auto* o) { o->min_triangulation_angle_deg = -1; }},
  });
}

TEST(SubmapOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<SubmapOptions>({
      {"camera_model", [](auto* o) { o->camera_model = "FISHY"; }},
      {"local_ba_images", [](auto* o) { o->local_ba_images = 2; }},
      {"max_images_all_global", [](auto* o) { o->max_images_all_global = -1; }},
      {"global_growth", [](auto* o) { o->global_growth = 1; }},
      {"min_rebuild_gain", [](auto* o) { o->min_rebuild_gain = -1; }},
      {"num_threads", [](auto* o) { o->num_threads = 0; }},
  });
}

}  // namespace skein::mapping_options_test
