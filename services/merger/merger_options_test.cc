#include "merger/merger_options.h"

#include <gtest/gtest.h>

#include "testing/test_options.h"

namespace skein::merger_options_test {

TEST(MergerOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<MergerOptions>({
      {"wait_for_mapper", [](auto* o) { o->wait_for_mapper_s = -1; }},
  });
}

}  // namespace skein::merger_options_test
