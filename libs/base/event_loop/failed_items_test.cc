#include "event_loop/failed_items.h"

#include <gtest/gtest.h>

#include <csignal>

#include "testing/test_folder.h"

namespace skein::failed_items_test {

const std::vector<Step> kDiedOn7 = {{7, "depth map"}};

FailedItems Failed(const std::filesystem::path& session, const std::vector<Step>& left,
                   int exit_signal) {
  return FailedItems(session, "dense.failed", "depth map", left, exit_signal);
}

TEST(FailedItems, ThirdDeathOnAnItemLeavesItOut) {
  const TestFolder folder;
  EXPECT_TRUE(Failed(folder.path(), kDiedOn7, SIGSEGV).LeftOut().empty());
  EXPECT_TRUE(Failed(folder.path(), {{8, "depth map"}}, SIGALRM).LeftOut().empty());
  EXPECT_TRUE(Failed(folder.path(), kDiedOn7, SIGSEGV).LeftOut().empty());
  EXPECT_EQ(Failed(folder.path(), kDiedOn7, SIGSEGV).LeftOut(), std::vector<int64_t>{7});
  EXPECT_EQ(Failed(folder.path(), {}, 0).LeftOut(), std::vector<int64_t>{7});
}

TEST(FailedItems, OtherDeathsDoNotCount) {
  const TestFolder folder;
  for (int i = 0; i < 5; ++i) {
    EXPECT_TRUE(Failed(folder.path(), kDiedOn7, i % 2 == 0 ? SIGTERM : 0).LeftOut().empty());
  }
}

TEST(FailedItems, TenthSigkillOnAnItemLeavesItOut) {
  const TestFolder folder;
  for (int i = 1; i < kMaxKills; ++i) {
    EXPECT_FALSE(Failed(folder.path(), kDiedOn7, SIGKILL).IsLeftOut(7)) << i;
  }
  EXPECT_TRUE(Failed(folder.path(), kDiedOn7, SIGKILL).IsLeftOut(7));
}

TEST(FailedItems, StepsOfAnotherNameDoNotCount) {
  const TestFolder folder;
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(Failed(folder.path(), {{7, "mesh"}}, SIGSEGV).LeftOut().empty());
  }
}

TEST(FailedItems, ErrorsCountToo) {
  FailedItems failed = Failed("", kDiedOn7, SIGABRT);
  EXPECT_FALSE(failed.Note(7));
  EXPECT_FALSE(failed.IsLeftOut(7));
  EXPECT_TRUE(failed.Note(7));
  EXPECT_TRUE(failed.IsLeftOut(7));
  EXPECT_FALSE(failed.Note(9));
}

}  // namespace skein::failed_items_test
