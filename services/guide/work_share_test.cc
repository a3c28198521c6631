#include "guide/work_share.h"

#include <gtest/gtest.h>

namespace skein {
namespace {

TEST(WorkShare, WorkBeginsAtOnce) { EXPECT_LE(WorkShare(0.1).due_s(), 0); }

TEST(WorkShare, AfterWorkComesARest) {
  WorkShare share(0.1);
  share.NoteWork(2, 100);
  EXPECT_NEAR(share.due_s(), 118, 1e-9);  // 2 s of 20
}

TEST(WorkShare, WithAllOfTheTimeThereIsNone) {
  WorkShare share(1);
  share.NoteWork(2, 100);
  EXPECT_EQ(share.due_s(), 100);
}

// Work that takes longer each time, as a map grows.
TEST(WorkShare, KeepsTheShareOverAll) {
  WorkShare share(0.2);
  double now_s = 0, worked_s = 0;
  for (int i = 1; i <= 50; ++i) {
    now_s = std::max(now_s, share.due_s()) + 0.1 * i;
    worked_s += 0.1 * i;
    share.NoteWork(0.1 * i, now_s);
  }
  EXPECT_NEAR(worked_s / share.due_s(), 0.2, 1e-9);
}

}  // namespace
}  // namespace skein
