#include <gtest/gtest.h>

#include "geometry/sim3_ransac.h"
#include "testing/test_options.h"

namespace skein::geometry_options_test {

TEST(Sim3Options, RefusesWhatMakesNoSense) {
  ExpectChecked<Sim3Options>({
      {"min_inlier_ratio", [](auto* o) { o->min_inlier_ratio = 0; }},
      {"min_inlier_images", [](auto* o) { o->min_inlier_images = 0; }},
      {"min_common_points", [](auto* o) { o->min_common_points = 0; }},
  });
}

}  // namespace skein::geometry_options_test
