#include "event_loop/sign_of_life.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <thread>

#include "event_loop/worker_thread.h"

namespace skein::sign_of_life_test {

namespace fs = std::filesystem;

class SignOfLifeTest : public testing::Test {
 protected:
  ~SignOfLifeTest() override { fs::remove_all(path_); }

  const std::string path_ =
      (fs::temp_directory_path() / ("skein_alive_" + std::to_string(::getpid()))).string();
  PollLoop loop_;
};

TEST_F(SignOfLifeTest, TouchesItsFileWhileTheLoopComesRound) {
  const SignOfLife sign(loop_, path_);
  EXPECT_FALSE(fs::exists(path_)) << "before the loop runs";
  ASSERT_TRUE(loop_.RunUntil([&] { return fs::exists(path_); }, 10));
  const auto first = fs::last_write_time(path_);
  EXPECT_TRUE(loop_.RunUntil([&] { return fs::last_write_time(path_) > first; }, 10));
}

TEST_F(SignOfLifeTest, DoesNothingWithoutAFile) {
  const SignOfLife sign(loop_, "");
  EXPECT_FALSE(loop_.RunUntil([&] { return fs::exists(path_); }, 0.7));
}

TEST_F(SignOfLifeTest, AFileThatCannotBeMadeIsTriedAgain) {
  const SignOfLife sign(loop_, path_ + "/file");
  loop_.RunUntil([] { return false; }, 0.7);
  fs::create_directory(path_);
  EXPECT_TRUE(loop_.RunUntil([&] { return fs::exists(path_ + "/file"); }, 10));
}

// Jobs of a worker by a clock of the test's own: a tick of it is one second of the loop.
class HungJobTest : public testing::Test {
 protected:
  static constexpr int kMaxQuietS = 5;

  void PassSeconds(int seconds) {
    for (int i = 0; i < seconds; ++i) {
      now_s_ = now_s_ + 1;
      loop_.RunUntil([] { return false; }, 0.01);
    }
  }

  std::atomic<double> now_s_{1000};
  PollLoop loop_{[this] { return now_s_.load(); }};
  int num_hangs_ = 0;
  std::atomic<bool> go_on_{false};
};

TEST_F(HungJobTest, AJobWithoutProgressHangs) {
  WorkerThread worker(loop_, kMaxQuietS, [this] { ++num_hangs_; });
  std::atomic<bool> is_begun{false};
  worker.Run(
      [this, &is_begun] {
        is_begun = true;
        while (!go_on_) std::this_thread::yield();
      },
      [] {});
  while (!is_begun) std::this_thread::yield();
  PassSeconds(kMaxQuietS - 1);
  EXPECT_EQ(num_hangs_, 0);
  PassSeconds(3);
  EXPECT_GT(num_hangs_, 0);
  go_on_ = true;
}

TEST_F(HungJobTest, AJobThatTellsOfItsStepsMayTakeAsLongAsItNeeds) {
  WorkerThread worker(loop_, kMaxQuietS, [this] { ++num_hangs_; });
  worker.Run(
      [this] {
        while (!go_on_) std::this_thread::yield();
      },
      [] {});
  for (int i = 0; i < 5; ++i) {
    PassSeconds(kMaxQuietS - 2);
    worker.NoteProgress();
  }
  EXPECT_EQ(num_hangs_, 0);
  go_on_ = true;
}

TEST_F(HungJobTest, AnIdleWorkerDoesNotHang) {
  const WorkerThread worker(loop_, kMaxQuietS, [this] { ++num_hangs_; });
  PassSeconds(3 * kMaxQuietS);
  EXPECT_EQ(num_hangs_, 0);
}

TEST_F(HungJobTest, APauseOfTheMachineIsNoHang) {
  WorkerThread worker(loop_, kMaxQuietS, [this] { ++num_hangs_; });
  worker.Run(
      [this] {
        while (!go_on_) std::this_thread::yield();
      },
      [] {});
  PassSeconds(1);
  now_s_ = now_s_ + 3600;
  PassSeconds(1);
  EXPECT_EQ(num_hangs_, 0);
  go_on_ = true;
}

TEST(HungJobDeathTest, EndsTheProcessByASignalOfItsOwn) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(WorkerThread::EndHungProcess(), testing::KilledBySignal(SIGALRM), "");
}

}  // namespace skein::sign_of_life_test
