#include "guide/work_share.h"

#include <gtest/gtest.h>

namespace skein::work_share_test {

TEST(WorkShare, WorkBeginsAtOnce) { EXPECT_LE(WorkShare(0.1).due_s(), 0); }

TEST(WorkShare, AfterWorkComesARest) {
  WorkShare share(0.1);
  share.NoteWork(2, 100);
  EXPECT_NEAR(share.due_s(), 120, 1e-9);  // 2 s of 20
}

TEST(WorkShare, WithAllOfTheTimeThereIsNone) {
  WorkShare share(1);
  share.NoteWork(2, 100);
  EXPECT_EQ(share.due_s(), 102);  // when it ends
}

// Work that takes longer each time, as a map grows.
TEST(WorkShare, KeepsTheShareOverAll) {
  WorkShare share(0.2);
  double now_s = 0, worked_s = 0;
  for (int i = 1; i <= 50; ++i) {
    now_s = std::max(now_s, share.due_s());
    worked_s += 0.1 * i;
    share.NoteWork(0.1 * i, now_s);
  }
  EXPECT_NEAR(worked_s / share.due_s(), 0.2, 1e-9);
}

// On busy cores work takes three times as long as its processor time; that was a rest, too.
TEST(WorkShare, TimeInWhichWorkWaitedForACoreIsRest) {
  WorkShare share(0.2);
  const double begin_s = 100, end_s = 106;
  share.NoteWork(2, begin_s);
  EXPECT_NEAR(share.due_s() - end_s, 4, 1e-9);
}

}  // namespace skein::work_share_test
