#include "core/snapshot.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <stdexcept>

namespace skein::snapshot_test {

TEST(Snapshot, HoldsWhatWasThereWhenItWasTaken) {
  Bytes state(3 << 20, 1);
  const auto snapshot = Snapshot::Take([&] { return state; });
  ASSERT_TRUE(snapshot.ok());
  state.assign(state.size(), 2);
  const Result<Bytes> bytes = (*snapshot)->Read();
  ASSERT_TRUE(bytes.ok()) << bytes.error();
  EXPECT_EQ(*bytes, Bytes(3 << 20, 1));
  EXPECT_EQ(state[0], 2);
}

TEST(Snapshot, SaysWhenItsProcessFails) {
  const auto thrown = Snapshot::Take([]() -> Bytes { throw std::runtime_error("no"); });
  ASSERT_TRUE(thrown.ok());
  EXPECT_FALSE((*thrown)->Read().ok());
  const auto killed = Snapshot::Take([]() -> Bytes {
    kill(getpid(), SIGKILL);
    return {1};
  });
  ASSERT_TRUE(killed.ok());
  EXPECT_FALSE((*killed)->Read().ok());
}

TEST(Snapshot, LeavesNoProcessWhenItIsDropped) {
  {
    const auto snapshot = Snapshot::Take([]() -> Bytes {
      for (;;) pause();
    });
    ASSERT_TRUE(snapshot.ok());
  }
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);
  EXPECT_EQ(errno, ECHILD);
}

}  // namespace skein::snapshot_test
