#include "matching/matching_options.h"

#include <gtest/gtest.h>

#include "testing/test_options.h"

namespace skein::matching_options_test {

TEST(MatchingServiceOptions, RefusesWhatMakesNoSense) {
  ExpectChecked<MatchingServiceOptions>({
      {"cache_mib is 0: give 1 to", [](auto* o) { o->cache_mib = 0; }},
  });
}

}  // namespace skein::matching_options_test
