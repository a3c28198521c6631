#include "matching/matching_options.h"

#include <gtest/gtest.h>

#include "testing/test_options.h"

namespace skein::matching_options_test {

TEST(MatchingServiceOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<MatchingServiceOptions>({
      {"cache_mib is 0: give 1 to", [](auto* o) { o->cache_mib = 0; }},
      {"max_ratio is 1.5: give 0 to 1", [](auto* o) { o->pair.matching.max_ratio = 1.5; }},
      {"max_error is 0: give 0.1 to 1000", [](auto* o) { o->pair.two_view.max_error_px = 0; }},
      {"min_inliers is 7: give 8 to 10000", [](auto* o) { o->pair.two_view.min_num_inliers = 7; }},
      {"min_inlier_ratio is 0: give 0.01 to 1",
       [](auto* o) { o->pair.two_view.min_inlier_ratio = 0; }},
      {"max_trials is 0: give 1 to", [](auto* o) { o->pair.two_view.max_num_trials = 0; }},
      {"threads", [](auto* o) { o->num_threads = 0; }},
  });
}

}  // namespace skein::matching_options_test
