#include "features/idle_cores.h"

#include <gtest/gtest.h>

namespace skein::idle_cores_test {

TEST(ThreadsForIdleCores, TakesTheCoresThatNobodyRunsOn) {
  EXPECT_EQ(ThreadsForIdleCores("0.10 0.20 0.30 1/321 99", 8, 8), 8);
  EXPECT_EQ(ThreadsForIdleCores("0.10 0.20 0.30 4/321 99", 8, 8), 5);
  EXPECT_EQ(ThreadsForIdleCores("0.10 0.20 0.30 1/321 99", 8, 2), 2);
}

TEST(ThreadsForIdleCores, IsOneWhereAllAreBusy) {
  EXPECT_EQ(ThreadsForIdleCores("9.00 9.00 9.00 8/321 99", 8, 8), 1);
  EXPECT_EQ(ThreadsForIdleCores("9.00 9.00 9.00 40/321 99", 8, 8), 1);
}

TEST(ThreadsForIdleCores, IsTheLimitWhereNothingIsKnown) {
  EXPECT_EQ(ThreadsForIdleCores("", 8, 4), 4);
  EXPECT_GE(ThreadsForIdleCores(4), 1);
}

}  // namespace skein::idle_cores_test
