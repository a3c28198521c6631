#include "merger/merger_options.h"

#include <gtest/gtest.h>

#include "testing/test_options.h"

namespace skein::merger_options_test {

TEST(MergerOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<MergerOptions>({
      {"min_shared_images", [](auto* o) { o->merge.min_shared_images = 2; }},
      {"trials", [](auto* o) { o->sim3.num_trials = 0; }},
      {"seed_min_inliers", [](auto* o) { o->seed.min_inliers = 1; }},
      {"wait_for_mapper", [](auto* o) { o->wait_for_mapper_s = -1; }},
  });
}

}  // namespace skein::merger_options_test
