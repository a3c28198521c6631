#include <gtest/gtest.h>

#include "mapping/initial_pair.h"
#include "mapping/submap_options.h"
#include "testing/test_options.h"

namespace skein::mapping_options_test {

TEST(InitialPairOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<InitialPairOptions>({
      {"min_num_inliers", [](auto* o) { o->min_num_inliers = 0; }},
      {"max_error_px", [](auto* o) { o->max_error_px = 0; }},
      {"max_forward_motion", [](auto* o) { o->max_forward_motion = 1.5; }},
      {"min_triangulation_angle_deg", [](auto* o) { o->min_triangulation_angle_deg = -1; }},
  });
}

TEST(MisplacedOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<MisplacedOptions>({
      {"max_error_px", [](auto* o) { o->max_error_px = 0; }},
      {"min_contradiction", [](auto* o) { o->min_contradiction = 0; }},
      {"min_pair_share", [](auto* o) { o->min_pair_share = -1; }},
      {"max_photos_around", [](auto* o) { o->max_photos_around = 0; }},
  });
}

TEST(RegistrationOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<RegistrationOptions>({
      {"max_error_px", [](auto* o) { o->max_error_px = 0; }},
      {"ransac_limits_px is empty", [](auto* o) { o->ransac_limits_px.clear(); }},
      {"ransac_limits_px is 0",
       [](auto* o) {
         o->ransac_limits_px = {4, 0};
       }},
      {"min_num_inliers", [](auto* o) { o->min_num_inliers = 3; }},
      {"min_inlier_ratio", [](auto* o) { o->min_inlier_ratio = 0; }},
      {"max_num_trials", [](auto* o) { o->max_num_trials = 0; }},
      {"min_num_trials", [](auto* o) { o->min_num_trials = 20000; }},
      {"confidence", [](auto* o) { o->confidence = 1; }},
      {"max_position_sigma", [](auto* o) { o->max_position_sigma = 0; }},
      {"max_frame_sigma_px", [](auto* o) { o->max_frame_sigma_px = 0; }},
      {"min_epipolar_share", [](auto* o) { o->min_epipolar_share = 2; }},
      {"max_epipolar_error_px", [](auto* o) { o->max_epipolar_error_px = 0; }},
      {"max_focal_factor", [](auto* o) { o->max_focal_factor = 0; }},
      {"min_focal_factor", [](auto* o) { o->min_focal_factor = 3; }},
      {"similar_structures: min_cells", [](auto* o) { o->similar_structures.min_cells = 0; }},
  });
}

TEST(SubmapOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<SubmapOptions>({
      {"camera_model", [](auto* o) { o->camera_model = "FISHY"; }},
      {"registration: min_num_inliers", [](auto* o) { o->registration.min_num_inliers = 0; }},
      {"registration: similar_structures: num_rows",
       [](auto* o) { o->registration.similar_structures.num_rows = 0; }},
      {"filter: max_reprojection_error_px",
       [](auto* o) { o->filter.max_reprojection_error_px = 0; }},
      {"misplaced: min_contradiction", [](auto* o) { o->misplaced.min_contradiction = 0; }},
      {"triangulation", [](auto* o) { o->triangulation.min_angle = -1; }},
      {"make_local", [](auto* o) { o->make_local = nullptr; }},
      {"max_images_all_global", [](auto* o) { o->max_images_all_global = -1; }},
      {"global_growth", [](auto* o) { o->global_growth = 1; }},
      {"min_observations", [](auto* o) { o->min_observations = -1; }},
      {"min_observed_ratio", [](auto* o) { o->min_observed_ratio = 2; }},
      {"max_withdrawals", [](auto* o) { o->max_withdrawals = -1; }},
      {"min_yield_ratio", [](auto* o) { o->min_yield_ratio = 0; }},
      {"min_rebuild_gain", [](auto* o) { o->min_rebuild_gain = -1; }},
      {"num_threads", [](auto* o) { o->num_threads = 0; }},
  });
}

}  // namespace skein::mapping_options_test
