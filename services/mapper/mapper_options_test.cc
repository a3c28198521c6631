#include "mapper/mapper_options.h"

#include <gtest/gtest.h>

#include "testing/test_options.h"

namespace skein::mapper_options_test {

TEST(MapperOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<MapperOptions>({
      {"camera_model is \"FISHY\"", [](auto* o) { o->run.submap.camera_model = "FISHY"; }},
      {"target_gsd", [](auto* o) { o->run.target_gsd_mm = -1; }},
      {"local_ba_images", [](auto* o) { o->run.submap.local_ba_images = 2; }},
      {"retire_after", [](auto* o) { o->retire_after_s = -1; }},
  });
}

}  // namespace skein::mapper_options_test
