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

TEST(MisplacedOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<MisplacedOptions>({
      {"min_contradiction", [](auto* o) { o->min_contradiction = 0; }},
      {"min_pair_share", [](auto* o) { o->min_pair_share = -1; }},
      {"max_photos_around", [](auto* o) { o->max_photos_around = 0; }},
  });
}

TEST(RegistrationOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<RegistrationOptions>({
      {"ransac_limits_px is empty", [](auto* o) { o->ransac_limits_px.clear(); }},
      {"ransac_limits_px is 0",
       [](auto* o) {
         o->ransac_limits_px = {4, 0};
       }},
      {"max_position_sigma", [](auto* o) { o->max_position_sigma = 0; }},
      {"max_frame_sigma_px", [](auto* o) { o->max_frame_sigma_px = 0; }},
      {"min_epipolar_share", [](auto* o) { o->min_epipolar_share = 2; }},
      {"max_focal_factor", [](auto* o) { o->max_focal_factor = 0; }},
      {"min_focal_factor", [](auto* o) { o->min_focal_factor = 3; }},
      {"min_cells", [](auto* o) { o->min_cells = 0; }},
  });
}

TEST(SubmapOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<SubmapOptions>({
      {"camera_model", [](auto* o) { o->camera_model = "FISHY"; }},
      {"registration: min_cells", [](auto* o) { o->registration.min_cells = 0; }},
      {"misplaced: min_contradiction", [](auto* o) { o->misplaced.min_contradiction = 0; }},
      {"make_local", [](auto* o) { o->make_local = nullptr; }},
      {"max_images_all_global", [](auto* o) { o->max_images_all_global = -1; }},
      {"global_growth", [](auto* o) { o->global_growth = 1; }},
      {"min_observations", [](auto* o) { o->min_observations = -1; }},
      {"min_observed_ratio", [](auto* o) { o->min_observed_ratio = 2; }},
      {"max_withdrawals", [](auto* o) { o->max_withdrawals = -1; }},
      {"min_rebuild_gain", [](auto* o) { o->min_rebuild_gain = -1; }},
      {"num_threads", [](auto* o) { o->num_threads = 0; }},
  });
}

}  // namespace skein::mapping_options_test
