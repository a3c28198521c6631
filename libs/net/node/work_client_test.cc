#include "node/work_client.h"

#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>

#include "testing/test_node.h"

namespace skein::work_client_test {

class WorkClientTest : public testing::Test {
 protected:
  WorkClientTest() {
    bus_.Subscribe(kWorkRequestChannel,
                   [this](const work_request_t& r) { requests_.push_back(r); });
    bus_.Subscribe(kWorkFailedChannel, [this](const work_failed_t& f) { failures_.push_back(f); });
  }
  void HandOut(int64_t item_id, int64_t epoch = 0, const std::string& worker = "worker",
               const std::string& kind = "features") {
    work_t work{};
    work.worker = worker;
    work.kind = kind;
    work.item_id = item_id;
    work.epoch = epoch;
    node_.Publish(kWorkChannel, work);
  }
  bool WaitFor(const std::function<bool()>& done) { return loop_.RunUntil(done, 10); }

  double skipped_s_ = 0;
  PollLoop loop_{[this] { return MonotonicS() + skipped_s_; }};
  Bus bus_{"memq://", loop_};
  Node node_{TestOptions("worker"), loop_, bus_};
  std::vector<work_request_t> requests_;
  std::vector<work_failed_t> failures_;
  std::vector<int64_t> got_;
  WorkClient client_{node_, "features", 2, [this](const work_t& w) { got_.push_back(w.item_id); }};
};

TEST_F(WorkClientTest, AsksAtOnceAndRenewsWhatItHolds) {
  ASSERT_TRUE(WaitFor([&] { return !requests_.empty(); }));
  EXPECT_EQ(requests_[0].worker, "worker");
  EXPECT_EQ(requests_[0].capacity, 2);
  HandOut(7);
  ASSERT_TRUE(WaitFor([&] { return !requests_.empty() && requests_.back().num_held == 1; }));
  EXPECT_EQ(requests_.back().held, std::vector<int64_t>{7});
  EXPECT_EQ(requests_.back().capacity, 1);
  client_.Done(7);
  ASSERT_TRUE(WaitFor([&] { return requests_.back().num_held == 0; }));
  EXPECT_EQ(requests_.back().capacity, 2);
}

TEST_F(WorkClientTest, TakesAnItemOnceAndNoMoreThanItsCapacity) {
  HandOut(1, 0, "somebody-else");
  for (const int64_t item : {2, 2, 3, 4}) HandOut(item);
  ASSERT_TRUE(WaitFor([&] { return client_.num_held() == 2; }));
  EXPECT_FALSE(loop_.RunUntil([&] { return got_.size() > 2; }, 0.1));
  EXPECT_EQ(got_, (std::vector<int64_t>{2, 3}));
}

TEST_F(WorkClientTest, NamesTheItemFirstThatIsWorkedOn) {
  for (const int64_t item : {3, 7}) HandOut(item);
  ASSERT_TRUE(WaitFor([&] { return !requests_.empty() && requests_.back().num_held == 2; }));
  EXPECT_EQ(requests_.back().held, (std::vector<int64_t>{3, 7}));
  client_.SetCurrent(7);
  ASSERT_TRUE(WaitFor([&] { return requests_.back().held.front() == 7; }));
  EXPECT_EQ(requests_.back().held, (std::vector<int64_t>{7, 3}));
  client_.Done(7);
  ASSERT_TRUE(WaitFor([&] { return requests_.back().num_held == 1; }));
  EXPECT_EQ(requests_.back().held, (std::vector<int64_t>{3}));
}

TEST_F(WorkClientTest, TellsOfAHeldItemAgainWhenItsEpochRises) {
  for (const int64_t epoch : {1, 1, 2, 1}) HandOut(5, epoch);
  ASSERT_TRUE(WaitFor([&] { return got_.size() == 2; }));
  EXPECT_FALSE(loop_.RunUntil([&] { return got_.size() > 2; }, 0.1));
}

TEST_F(WorkClientTest, RepeatsAFailureUntilItIsInTheLedger) {
  HandOut(9);
  ASSERT_TRUE(WaitFor([&] { return client_.holds(9); }));
  client_.Fail(9, "no keypoints", true);
  EXPECT_FALSE(client_.holds(9));
  ASSERT_TRUE(WaitFor([&] { return failures_.size() >= 2; }));
  EXPECT_EQ(failures_[0].reason, "no keypoints");
  EXPECT_TRUE(failures_[0].permanent);

  failure_t fact{};
  fact.image_id = 9;
  fact.stage = "features";
  fact.header.session_id = node_.session_id();
  node_.NoteCommitted(fact);
  const size_t told = failures_.size();
  skipped_s_ += 1.2;
  EXPECT_FALSE(loop_.RunUntil([&] { return failures_.size() > told + 1; }, 0.1));
}

TEST_F(WorkClientTest, CapacityMayChange) {
  client_.SetCapacity(0);
  HandOut(1);
  EXPECT_FALSE(loop_.RunUntil([&] { return !got_.empty(); }, 0.1));
  client_.SetCapacity(1);
  ASSERT_TRUE(WaitFor([&] { return !requests_.empty() && requests_.back().capacity == 1; }));
}

TEST_F(WorkClientTest, GivesBackWhatItHoldsWhenItEnds) {
  auto leaving = std::make_unique<WorkClient>(node_, "submap", 1, [](const work_t&) {});
  HandOut(5, 1, "worker", "submap");
  ASSERT_TRUE(WaitFor([&] { return leaving->holds(5); }));
  leaving.reset();
  ASSERT_TRUE(WaitFor([&] { return !requests_.empty() && requests_.back().capacity < 0; }));
  EXPECT_EQ(requests_.back().kind, "submap");
  EXPECT_EQ(requests_.back().worker, "worker");
  EXPECT_EQ(requests_.back().num_held, 0);
}

TEST_F(WorkClientTest, AnExceptionThatEndsItFailsTheItemAtWork) {
  try {
    WorkClient ending(node_, "submap", 2, [](const work_t&) {});
    for (const int64_t item : {5, 6}) HandOut(item, 1, "worker", "submap");
    ASSERT_TRUE(WaitFor([&] { return ending.num_held() == 2; }));
    ending.SetCurrent(6);
    throw std::runtime_error("a handler threw");
  } catch (const std::runtime_error&) {
  }
  ASSERT_TRUE(WaitFor([&] { return !requests_.empty() && requests_.back().capacity < 0; }));
  ASSERT_EQ(failures_.size(), 1u) << "5 is given back as good";
  EXPECT_EQ(failures_[0].item_id, 6);
  EXPECT_EQ(failures_[0].epoch, 1);
  EXPECT_FALSE(failures_[0].permanent);
}

TEST(NodeTest, RefusesUnusableOptions) {
  PollLoop loop;
  Bus bus("memq://", loop);
  NodeOptions options;
  options.service = "x";
  EXPECT_THROW(Node(options, loop, bus), std::invalid_argument);  // no session
  options.session_id = "s";
  options.instance = "bad name";
  EXPECT_THROW(Node(options, loop, bus), std::invalid_argument);
  options.instance = "good";
  options.session_dir = "/tmp/also";
  EXPECT_THROW(Node(options, loop, bus), std::invalid_argument);
}

TEST(NodeTest, HeartbeatTellsWhatTheServiceFillsIn) {
  PollLoop loop;
  Bus bus("memq://", loop);
  Node node(TestOptions("worker"), loop, bus);
  node.OnHeartbeat([](heartbeat_t* beat) {
    beat->state = "matching";
    beat->backlog = 3;
  });
  heartbeat_t heard{};
  bus.Subscribe(kHeartbeatChannel, [&](const heartbeat_t& beat) { heard = beat; });
  ASSERT_TRUE(loop.RunUntil([&] { return heard.pid != 0; }, 10));
  EXPECT_EQ(heard.state, "matching");
  EXPECT_EQ(heard.backlog, 3);
  EXPECT_EQ(heard.instance, "worker");
  EXPECT_EQ(heard.session_id, node.session_id());
  EXPECT_GT(heard.memory_bytes, 0);
}

}  // namespace skein::work_client_test
