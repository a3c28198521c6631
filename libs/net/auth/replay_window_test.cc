#include "auth/replay_window.h"

#include <gtest/gtest.h>

namespace skein::replay_window_test {

TEST(ReplayWindow, TakesEachCounterOnceInAnyOrder) {
  ReplayWindow window;
  for (const uint64_t counter : {5, 3, 900, 4, 899}) EXPECT_TRUE(window.Accept(counter)) << counter;
  for (const uint64_t counter : {5, 3, 900, 4, 899}) EXPECT_FALSE(window.Accept(counter));
  EXPECT_EQ(window.highest(), 900u);
}

TEST(ReplayWindow, RefusesWhatIsUpToTheFloor) {
  ReplayWindow window(10);
  EXPECT_EQ(window.highest(), 10u);
  EXPECT_FALSE(window.Accept(0));
  EXPECT_FALSE(window.Accept(10));
  EXPECT_TRUE(window.Accept(11));
}

TEST(ReplayWindow, HoldsItsSizeAndRefusesWhatIsOlder) {
  ReplayWindow window;
  constexpr uint64_t kNum = 10 * ReplayWindow::kSize;
  for (uint64_t i = 1; i <= kNum; ++i) ASSERT_TRUE(window.Accept(2 * i));
  EXPECT_FALSE(window.Accept(3)) << "long past, though never seen";
  for (uint64_t i = 0; i + 1 < ReplayWindow::kSize; ++i) {
    ASSERT_FALSE(window.Accept(2 * (kNum - i))) << "seen, " << i << " messages ago";
  }
  EXPECT_TRUE(window.Accept(2 * (kNum - ReplayWindow::kSize / 2) + 1)) << "late, never seen";
}

}  // namespace skein::replay_window_test
