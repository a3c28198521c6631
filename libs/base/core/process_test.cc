#include "core/process.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <stdexcept>

#include "core/clock.h"

namespace skein::process_test {

TEST(Process, KnowsItsMemoryAndHost) {
  EXPECT_GT(ResidentMemoryBytes(), 100 * 1024);
  EXPECT_GE(PeakMemoryBytes(), ResidentMemoryBytes());
  EXPECT_FALSE(HostName().empty());
  EXPECT_NE(RandomU64(), RandomU64());
}

TEST(Process, CapsThreads) {
  CapThreads(2);
  EXPECT_STREQ(std::getenv("OMP_NUM_THREADS"), "2");
  EXPECT_THROW(CapThreads(0), std::invalid_argument);
}

TEST(Process, EndsWithinItsTimeWhateverItsThreadsDo) {
  EXPECT_EXIT(
      {
        EndProcessWithin(0.05);
        while (true) ::pause();
      },
      testing::ExitedWithCode(0), "");
}

TEST(Clock, Advances) {
  const Timer timer;
  const double start_s = MonotonicS();
  while (MonotonicS() == start_s) continue;
  EXPECT_GT(timer.ElapsedS(), 0);
  EXPECT_GT(NowUs(), 1'600'000'000'000'000);
}

}  // namespace skein::process_test
