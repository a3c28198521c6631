#include "merger/merger_options.h"

#include <gtest/gtest.h>

#include "testing/test_options.h"

namespace skein::merger_options_test {

TEST(MergerOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<MergerOptions>({
      {"min_shared_images", [](auto* o) { o->merge.min_shared_images = 2; }},
      {"min_shared_when_finishing", [](auto* o) { o->merge.min_shared_when_finishing = 0; }},
      {"min_linking_inliers", [](auto* o) { o->merge.min_linking_inliers = 0; }},
      {"growth", [](auto* o) { o->merge.growth = 0; }},
      {"trials", [](auto* o) { o->sim3.num_trials = 0; }},
      {"seed_min_inliers", [](auto* o) { o->seed.min_inliers = 1; }},
      {"wait_for_mapper", [](auto* o) { o->wait_for_mapper_s = -1; }},
      {"decide_period", [](auto* o) { o->decide_period_s = 0; }},
      {"request_period", [](auto* o) { o->request_period_s = 0; }},
      {"request_timeout", [](auto* o) { o->request_timeout_s = 0; }},
      {"idle_mapper", [](auto* o) { o->idle_mapper_s = -1; }},
      {"hold_after_refusal", [](auto* o) { o->hold_after_refusal_s = -1; }},
  });
}

}  // namespace skein::merger_options_test
