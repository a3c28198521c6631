#include "ingest/listening_clock.h"

#include <gtest/gtest.h>

namespace skein::listening_clock_test {

TEST(ListeningClock, CountsRoundsAsLongAsTheyTake) {
  ListeningClock clock;
  for (int i = 0; i <= 50; ++i) clock.NoteRound(1000 + i * 0.2);
  EXPECT_NEAR(clock.now_s(), 10, 1e-9);
}

TEST(ListeningClock, OfAHoldUpCountsNoMoreThanALongRound) {
  ListeningClock clock;
  clock.NoteRound(7);
  clock.NoteRound(7.2);
  clock.NoteRound(607.2);
  EXPECT_NEAR(clock.now_s(), 0.2 + ListeningClock::kLongestRoundS, 1e-9);
  clock.NoteRound(607.4);
  EXPECT_NEAR(clock.now_s(), 0.4 + ListeningClock::kLongestRoundS, 1e-9);
}

TEST(ListeningClock, NeverGoesBack) {
  ListeningClock clock;
  clock.NoteRound(7);
  clock.NoteRound(6);
  EXPECT_EQ(clock.now_s(), 0);
}

}  // namespace skein::listening_clock_test
