#include <gtest/gtest.h>

#include "merging/absorb.h"
#include "testing/test_options.h"

namespace skein::merging_options_test {

TEST(AbsorbOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<AbsorbOptions>({
      {"min_inlier_images", [](auto* o) { o->sim3.min_inlier_images = 0; }},
      {"intrinsics.min_images", [](auto* o) { o->intrinsics.min_images = 0; }},
      {"min_shared_images", [](auto* o) { o->min_shared_images = -1; }},
  });
}

}  // namespace skein::merging_options_test
