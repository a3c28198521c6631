#include "guide/guide_options.h"

#include <gtest/gtest.h>

namespace skein::guide_options_test {

TEST(GuideOptions, TheDefaultsAreSound) { EXPECT_TRUE(GuideOptions().Check().ok()); }

TEST(GuideOptions, SayWhatIsWrong) {
  GuideOptions options;
  options.work_share = 0;
  EXPECT_NE(options.Check().error().find("work_share"), std::string::npos);
  options = {};
  options.altitude = "80:30";
  EXPECT_NE(options.Check().error().find("MIN:MAX"), std::string::npos);
  options = {};
  options.no_go = "/nowhere/at/all";
  EXPECT_NE(options.Check().error().find("/nowhere/at/all"), std::string::npos);
}

TEST(Altitude, IsTwoNumbers) {
  ASSERT_TRUE(ParseAltitude("30:80.5").ok());
  EXPECT_EQ(ParseAltitude("30:80.5")->min_m, 30);
  EXPECT_EQ(ParseAltitude("30:80.5")->max_m, 80.5);
  EXPECT_EQ(ParseAltitude("-3:-2")->min_m, -3);
  for (const char* wrong : {"", "30", "30:", ":80", "80:30", "a:b", "30:80m", "30-80", "nan:nan"}) {
    EXPECT_FALSE(ParseAltitude(wrong).ok()) << wrong;
  }
}

TEST(NoGo, IsPolygonsOfCorners) {
  const Result<NoGoAreas> areas = ParseNoGo(
      "# the neighbour's garden\n48.1 11.5\n48.1 11.6 # gate\n# wall\n48.2 11.6\n\n\n"
      "1 2\n3 4\n5 6\n7 8\n");
  ASSERT_TRUE(areas.ok()) << areas.error();
  ASSERT_EQ(areas->size(), 2u);
  EXPECT_EQ((*areas)[0].size(), 3u);
  EXPECT_EQ((*areas)[1].size(), 4u);
  EXPECT_EQ((*areas)[0][1].longitude_deg, 11.6);
}

TEST(NoGo, RefusesWhatIsNoPolygon) {
  for (const char* wrong : {"", "# nothing\n", "48 11\n48 12\n", "48 11\n48 12\n49 x\n",
                            "48 11 3\n48 12\n49 12\n", "95 11\n48 12\n49 12\n"}) {
    EXPECT_FALSE(ParseNoGo(wrong).ok()) << wrong;
  }
  EXPECT_NE(ParseNoGo("48 11\n48 north\n").error().find("line 2"), std::string::npos);
}

}  // namespace skein::guide_options_test
