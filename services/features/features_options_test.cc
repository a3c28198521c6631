#include "features/features_options.h"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>

#include "config/option_section.h"
#include "testing/test_options.h"

namespace skein::features_options_test {

TEST(FeaturesOptions, RefuseNonsense) {
  ExpectChecked<FeaturesOptions>({
      {"sift", [](FeaturesOptions* o) { o->sift.method = "surf"; }},
      {"max_size", [](FeaturesOptions* o) { o->sift.max_image_px = 0; }},
      {"max_features", [](FeaturesOptions* o) { o->sift.max_features = 0; }},
  });
}

TEST(FeaturesOptions, TakeAKernelByItsName) {
  CLI::App app;
  FeaturesOptions options;
  AddOptions(app, &options);
  app.parse("--kernel portable");
  EXPECT_EQ(options.sift.kernel, InstructionSet::kPortable);
  EXPECT_NE(SectionText("features", &app, false).find("kernel = \"portable\""), std::string::npos);
  app.parse("--kernel fastest");
  EXPECT_EQ(options.sift.kernel, FastestInstructionSet());
  EXPECT_NE(SectionText("features", &app, false).find("kernel = \"fastest\""), std::string::npos);
  EXPECT_THROW(app.parse("--kernel mmx"), CLI::ValidationError);
}

}  // namespace skein::features_options_test
