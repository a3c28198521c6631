#include "clients/scale/engine_thread.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <optional>

namespace skein::engine_thread_test {

constexpr double kDeadlineS = 20;

// Remembers workers; a call waits until its gate is open.
class HeldEngine : public Engine {
 public:
  Result<std::vector<WorkerJob>> List() override {
    const Call call(this);
    if (!refusal.empty()) return Unavailable(refusal);
    return jobs;
  }
  Status Submit(const std::string& batch, const std::vector<std::string>& invitations,
                const std::vector<std::string>&, const std::vector<std::string>&) override {
    const Call call(this);
    submits.set_value();
    gate.get_future().wait();
    for (size_t i = 1; i <= invitations.size(); ++i) {
      jobs.push_back({batch + "-" + std::to_string(i), false, ""});
    }
    return Status::Ok();
  }
  Status Cancel(const std::vector<std::string>& workers) override {
    const Call call(this);
    cancelled.insert(cancelled.end(), workers.begin(), workers.end());
    return Status::Ok();
  }

  std::vector<WorkerJob> jobs;
  std::vector<std::string> cancelled;
  std::string refusal;  // of List
  std::promise<void> submits, gate;
  std::atomic<bool> overlapped{false};

 private:
  struct Call {
    explicit Call(HeldEngine* to) : engine(to) { Enter(1); }
    ~Call() { Enter(-1); }
    void Enter(int change) {
      if ((engine->num_running += change) > 1) engine->overlapped = true;
    }
    HeldEngine* const engine;
  };
  std::atomic<int> num_running{0};
};

class EngineThreadTest : public testing::Test {
 protected:
  PollLoop loop_;
  HeldEngine* const engine_ = new HeldEngine;  // thread_'s
  EngineThread thread_{loop_, std::unique_ptr<Engine>(engine_)};
};

TEST_F(EngineThreadTest, AnswersOnTheLoop) {
  engine_->jobs = {{"w1-1", true, ""}};
  std::optional<size_t> num_listed;
  thread_.List([&](const EngineThread::Jobs& jobs) { num_listed = jobs->size(); });
  EXPECT_TRUE(thread_.is_busy());
  ASSERT_TRUE(loop_.RunUntil([&] { return num_listed.has_value(); }, kDeadlineS));
  EXPECT_EQ(num_listed, 1u);
  EXPECT_FALSE(thread_.is_busy());
}

// As when Ctrl-C comes while workers are submitted: they would stay.
TEST_F(EngineThreadTest, TheEndCancelsWorkersOfASubmissionThatRuns) {
  thread_.Submit("w1", {"link", "link"}, {}, {}, [](const Status&) {});
  engine_->submits.get_future().wait();
  std::future<void> opening = std::async(std::launch::async, [this] {
    EXPECT_EQ(engine_->cancelled.size(), 0u);
    engine_->gate.set_value();
  });
  const Result<size_t> ended = thread_.CancelAllAndWait();
  opening.get();
  ASSERT_TRUE(ended.ok());
  EXPECT_EQ(*ended, 2u);
  EXPECT_EQ(engine_->cancelled, (std::vector<std::string>{"w1-1", "w1-2"}));
  EXPECT_FALSE(engine_->overlapped);
}

TEST_F(EngineThreadTest, TheEndTellsWhyWorkersMayBeLeft) {
  engine_->refusal = "no answer";
  EXPECT_EQ(thread_.CancelAllAndWait().error(), "no answer");
}

TEST_F(EngineThreadTest, TheEndOfNobodyCancelsNobody) {
  const Result<size_t> ended = thread_.CancelAllAndWait();
  ASSERT_TRUE(ended.ok());
  EXPECT_EQ(*ended, 0u);
  EXPECT_TRUE(engine_->cancelled.empty());
}

}  // namespace skein::engine_thread_test
