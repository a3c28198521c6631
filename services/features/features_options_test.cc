#include "features/features_options.h"

#include <gtest/gtest.h>

#include "testing/test_options.h"

namespace skein {
namespace {

TEST(FeaturesOptions, RefuseNonsense) {
  ExpectChecked<FeaturesOptions>({
      {"sift", [](FeaturesOptions* o) { o->sift.method = "surf"; }},
      {"max_size", [](FeaturesOptions* o) { o->sift.max_image_px = 0; }},
      {"max_features", [](FeaturesOptions* o) { o->sift.selection.max_features = 0; }},
  });
}

}  // namespace
}  // namespace skein
