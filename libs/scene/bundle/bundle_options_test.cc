#include <gtest/gtest.h>

#include <cmath>

#include "bundle/bundle.h"
#include "testing/test_options.h"

namespace skein::bundle_options_test {

TEST(BundleOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<BundleOptions>({
      {"max_iterations", [](auto* o) { o->max_iterations = -1; }},
      {"function_tolerance", [](auto* o) { o->function_tolerance = std::nan(""); }},
      {"loss_scale_px", [](auto* o) { o->loss_scale_px = 0; }},
      {"num_threads", [](auto* o) { o->num_threads = 0; }},
  });
}

}  // namespace skein::bundle_options_test
