#include "event_loop/poll_loop.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <stdexcept>
#include <thread>

#include "core/attempt.h"
#include "core/clock.h"
#include "event_loop/worker_thread.h"

namespace skein::poll_loop_test {

TEST(PollLoop, RunsWhatOtherThreadsPostInOrder) {
  PollLoop loop;
  std::vector<int> ran;
  std::thread poster([&] {
    for (int i = 0; i < 100; ++i) loop.Post([&ran, i] { ran.push_back(i); });
  });
  EXPECT_TRUE(loop.RunUntil([&] { return ran.size() == 100; }, 10));
  poster.join();
  for (int i = 0; i < 100; ++i) EXPECT_EQ(ran[i], i);
}

TEST(PollLoop, TimersTickAndOneShotsFireOnce) {
  PollLoop loop;
  int ticks = 0, shots = 0;
  const auto timer = loop.AddTimer(0.005, [&] { ++ticks; });
  loop.AddOneShot(0.001, [&] { ++shots; });
  EXPECT_TRUE(loop.RunUntil([&] { return ticks == 5; }, 10));
  EXPECT_EQ(shots, 1);
  loop.CancelTimer(timer);
  EXPECT_FALSE(loop.RunUntil([&] { return ticks > 5; }, 0.05));
  EXPECT_THROW(loop.AddTimer(0, [] {}), std::invalid_argument);
}

TEST(PollLoop, TimersGoByTheClockThatIsPassedIn) {
  double now_s = 100;
  PollLoop loop([&] { return now_s; });
  int ticks = 0;
  loop.AddTimer(3600, [&] { ++ticks; });
  EXPECT_FALSE(loop.RunUntil([&] { return ticks > 0; }, 0.02));
  now_s += 3600;
  EXPECT_TRUE(loop.RunUntil([&] { return ticks > 0; }, 10));
  EXPECT_EQ(loop.now_s(), 3700);
}

TEST(PollLoop, ATimerMayCancelItself) {
  PollLoop loop;
  int ticks = 0;
  PollLoop::TimerId timer = 0;
  timer = loop.AddTimer(0.001, [&] {
    ++ticks;
    loop.CancelTimer(timer);
  });
  EXPECT_FALSE(loop.RunUntil([&] { return ticks > 1; }, 0.05));
  EXPECT_EQ(ticks, 1);
}

TEST(PollLoop, WatchesDescriptorsAndAHandlerMayRemoveItsOwn) {
  PollLoop loop;
  int fds[2];
  ASSERT_EQ(::pipe(fds), 0);
  int reads = 0;
  loop.AddFd(fds[0], [&] {
    ++reads;
    loop.RemoveFd(fds[0]);
  });
  EXPECT_THROW(loop.AddFd(fds[0], [] {}), std::logic_error);
  ASSERT_EQ(::write(fds[1], "ab", 2), 2);
  EXPECT_FALSE(loop.RunUntil([&] { return reads > 1; }, 0.05));
  EXPECT_EQ(reads, 1);
  bool writable = false;
  loop.AddFd(fds[1], [] {});
  loop.SetOnWritable(fds[1], [&] { writable = true; });
  EXPECT_TRUE(loop.RunUntil([&] { return writable; }, 10));
  loop.RemoveFd(fds[1]);
  ::close(fds[0]);
  ::close(fds[1]);
}

TEST(PollLoop, StopsOnASignal) {
  PollLoop loop;
  loop.StopOnSignals();
  loop.Post([] { ::raise(SIGTERM); });
  loop.Run();
  EXPECT_TRUE(loop.interrupted());
}

TEST(PollLoop, AnExceptionOfATimerIsNotedAndTheTimerTicksOn) {
  PollLoop loop;
  int ticks = 0;
  loop.AddTimer(0.001, [&] {
    if (++ticks < 3) throw std::runtime_error("no time");
  });
  EXPECT_TRUE(loop.RunUntil([&] { return ticks == 4; }, 10));
  EXPECT_EQ(loop.thrown().count, 2);
  EXPECT_EQ(loop.thrown().last, "a timer: no time");
}

TEST(PollLoop, AOneShotThatThrowsIsCalledAgainUnlessItIsCancelled) {
  double now_s = 100;
  PollLoop loop([&] { return now_s; });
  int shots = 0, cancelled = 0;
  loop.AddOneShot(0, [&] {
    if (++shots == 1) throw std::runtime_error("not yet");
  });
  PollLoop::TimerId other = 0;
  other = loop.AddOneShot(0, [&] {
    ++cancelled;
    throw std::runtime_error("never");
  });
  ASSERT_TRUE(loop.RunUntil([&] { return loop.thrown().count == 2; }, 10));
  loop.CancelTimer(other);
  EXPECT_FALSE(loop.RunUntil([&] { return shots > 1; }, 0.02)) << "not before kRetryS";
  now_s += PollLoop::kRetryS;
  EXPECT_TRUE(loop.RunUntil([&] { return shots == 2; }, 10));
  now_s += PollLoop::kRetryS;
  EXPECT_FALSE(loop.RunUntil([&] { return shots > 2; }, 0.02));
  EXPECT_EQ(cancelled, 1);
}

TEST(PollLoop, ABrokenStateOfATimerLeavesRun) {
  PollLoop loop;
  loop.AddTimer(0.001, [] { throw BrokenState("half a fact"); });
  EXPECT_THROW(loop.Run(), BrokenState);
}

TEST(PollLoop, AnExceptionOfAHandlerLeavesRun) {
  PollLoop loop;
  loop.Post([] { throw std::runtime_error("broken"); });
  EXPECT_THROW(loop.Run(), std::runtime_error);
}

TEST(WorkerThread, RunsJobsOffTheLoopAndTheRestOnIt) {
  PollLoop loop;
  WorkerThread worker(loop);
  const auto loop_thread = std::this_thread::get_id();
  std::vector<int> results;
  for (int i = 0; i < 10; ++i) {
    worker.Run(
        [i, loop_thread] {
          EXPECT_NE(std::this_thread::get_id(), loop_thread);
          return i * i;
        },
        [&results, loop_thread](int square) {
          EXPECT_EQ(std::this_thread::get_id(), loop_thread);
          results.push_back(square);
        });
  }
  bool done = false;
  worker.Run([] {}, [&done] { done = true; });
  EXPECT_EQ(worker.num_pending(), 11);
  ASSERT_TRUE(loop.RunUntil([&] { return done; }, 10));
  EXPECT_EQ(worker.num_pending(), 0);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(results[i], i * i);
}

TEST(WorkerThread, CallsNothingAfterItsEnd) {
  PollLoop loop;
  bool called = false;
  {
    WorkerThread worker(loop);
    for (int i = 0; i < 3; ++i) worker.Run([] { return 1; }, [&](int) { called = true; });
  }
  EXPECT_FALSE(loop.RunUntil([&] { return called; }, 0.05));
}

TEST(WorkerThread, AnExceptionOfAJobLeavesRun) {
  PollLoop loop;
  WorkerThread worker(loop);
  worker.Run([]() -> int { throw std::runtime_error("broken job"); }, [](int) {});
  EXPECT_THROW(loop.Run(), std::runtime_error);
}

}  // namespace skein::poll_loop_test
