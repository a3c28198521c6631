#include "http/job_pool.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <future>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <vector>

namespace skein::job_pool_test {

constexpr std::chrono::seconds kDeadline(20);
constexpr double kLongS = 1000, kShortS = 0.02;

// Jobs that wait until they are let go, as where the disk hangs.
class Gate {
 public:
  void Pass() {
    std::unique_lock<std::mutex> lock(mutex_);
    ++inside_;
    most_ = std::max(most_, inside_);
    changed_.notify_all();
    changed_.wait(lock, [this] { return open_; });
    --inside_;
  }
  bool WaitUntilInside(int count) {
    std::unique_lock<std::mutex> lock(mutex_);
    return changed_.wait_for(lock, kDeadline, [&] { return inside_ == count; });
  }
  void Open() {
    const std::lock_guard<std::mutex> lock(mutex_);
    open_ = true;
    changed_.notify_all();
  }
  int most() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return most_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool open_ = false;
  int inside_ = 0, most_ = 0;
};

bool IsDoneSoon(std::promise<void>* done) {
  return done->get_future().wait_for(kDeadline) == std::future_status::ready;
}

TEST(JobPool, RunsSoManyAtATimeInTheirOrder) {
  Gate gate;
  JobPool pool(2, 10, kLongS);
  std::mutex mutex;
  std::vector<int> order;
  std::promise<void> done;
  for (int i = 0; i < 5; ++i) pool.Run([&gate] { gate.Pass(); });
  ASSERT_TRUE(gate.WaitUntilInside(2));
  for (int i = 0; i < 5; ++i) {
    pool.Run([&, i] {
      const std::lock_guard<std::mutex> lock(mutex);
      order.push_back(i);
      if (order.size() == 5) done.set_value();
    });
  }
  gate.Open();
  EXPECT_TRUE(IsDoneSoon(&done));
  EXPECT_EQ(gate.most(), 2);
  EXPECT_EQ(order.size(), 5u);
}

TEST(JobPool, JobsThatHangHoldUpNoOthers) {
  Gate gate;
  JobPool pool(2, 4, kShortS);
  for (int i = 0; i < 4; ++i) pool.Run([&gate] { gate.Pass(); });
  ASSERT_TRUE(gate.WaitUntilInside(4));
  std::promise<void> done;
  pool.Run([&done] { done.set_value(); });
  EXPECT_TRUE(IsDoneSoon(&done));
  gate.Open();
}

TEST(JobPool, HasNoMoreThreadsThanItMay) {
  Gate gate;
  JobPool pool(2, 1, kShortS);
  std::promise<void> done;
  for (int i = 0; i < 8; ++i) pool.Run([&gate] { gate.Pass(); });
  pool.Run([&done] { done.set_value(); });
  ASSERT_TRUE(gate.WaitUntilInside(3));
  gate.Open();
  EXPECT_TRUE(IsDoneSoon(&done));
  EXPECT_EQ(gate.most(), 3);
}

TEST(JobPool, GoesOnAfterAJobThatThrows) {
  JobPool pool(1);
  std::promise<void> done;
  pool.Run([] { throw std::runtime_error("no"); });
  pool.Run([&done] { done.set_value(); });
  EXPECT_TRUE(IsDoneSoon(&done));
}

TEST(JobPool, WhatAJobHeldMayGiveAJob) {
  JobPool pool(1);
  std::promise<void> done;
  struct Held {
    ~Held() {
      pool->Run([done = done] { done->set_value(); });
    }
    JobPool* pool;
    std::promise<void>* done;
  };
  pool.Run([held = std::shared_ptr<Held>(new Held{&pool, &done})] {});
  EXPECT_TRUE(IsDoneSoon(&done));
}

}  // namespace skein::job_pool_test
