#include "guidance/place_summary.h"

#include <gtest/gtest.h>

namespace skein::place_summary_test {

TEST(PlaceSentence, SaysHowCompleteItIs) {
  Completeness place;
  place.good_share = 0.827;
  place.open_share = 0.1;
  PlaceVerdict verdict = VerdictOfPlace(place, 40, 300);
  EXPECT_EQ(verdict, PlaceVerdict::kNearly);
  EXPECT_EQ(PlaceSentence(verdict, place, 40, 12),
            "82 % of the surface is good, 12 open borders: nearly complete");
  place.open_share = 0.4;
  verdict = VerdictOfPlace(place, 40, 300);
  EXPECT_EQ(verdict, PlaceVerdict::kWeak);
  EXPECT_EQ(PlaceSentence(verdict, place, 40, 1),
            "82 % of the surface is good, 1 open border: keep going");
  place.good_share = 0.999;
  place.open_share = 0;
  place.complete = true;
  verdict = VerdictOfPlace(place, 40, 300);
  EXPECT_EQ(verdict, PlaceVerdict::kComplete);
  EXPECT_EQ(PlaceSentence(verdict, place, 40, 0), "99 % of the surface is good: complete");
  place.ground_share = 0.2;
  EXPECT_EQ(PlaceSentence(verdict, place, 40, 0),
            "99 % of the surface is good, not counting the ground: complete");
  place.ground_share = 0;
  place.complete = false;
  place.hole_share = 0.235;
  verdict = VerdictOfPlace(place, 40, 300);
  EXPECT_EQ(verdict, PlaceVerdict::kNearly);
  EXPECT_EQ(PlaceSentence(verdict, place, 40, 0),
            "99 % of the surface is good, 24 % of what the photos show has no points: nearly "
            "complete");
  place.hole_share = 0.5;
  EXPECT_EQ(VerdictOfPlace(place, 40, 300), PlaceVerdict::kWeak);
  verdict = VerdictOfPlace(place, 3, 300);
  EXPECT_EQ(verdict, PlaceVerdict::kGrowing);
  EXPECT_EQ(PlaceSentence(verdict, place, 3, 0),
            "too little to say yet, with 3 photos: keep going");
}

}  // namespace skein::place_summary_test
