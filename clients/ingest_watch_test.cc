#include "clients/ingest_watch.h"

#include <gtest/gtest.h>

#include <sstream>

#include "testing/test_node.h"

namespace skein::ingest_watch_test {

constexpr double kDeadlineS = 20;
constexpr double kSilentS = 0.2;

class IngestWatchTest : public testing::Test {
 protected:
  void Heartbeat(const std::string& service) {
    heartbeat_t heartbeat{};
    heartbeat.service = service;
    other_.Publish(kHeartbeatChannel, heartbeat);
  }
  std::string Told() {
    std::ostringstream told;
    watch_.TellChange("skein test", told);
    return told.str();
  }

  PollLoop loop_;
  Bus bus_{"memq://", loop_};
  Node other_{TestOptions("ingest-by-hand"), loop_, bus_};
  Node node_{TestOptions("agent.alice"), loop_, bus_};
  IngestWatch watch_{node_, kSilentS};
};

TEST_F(IngestWatchTest, TellsOnceThatNobodyAnswers) {
  EXPECT_EQ(Told(), "");
  ASSERT_TRUE(loop_.RunUntil([&] { return watch_.is_silent(); }, kDeadlineS));
  const std::string told = Told();
  EXPECT_EQ(told.rfind("skein test: no sign of ingest on ", 0), 0u) << told;
  EXPECT_NE(told.find("`skein launch`"), std::string::npos) << told;
  EXPECT_EQ(Told(), "");
}

TEST_F(IngestWatchTest, TellsThatIngestIsHeardAgain) {
  ASSERT_TRUE(loop_.RunUntil([&] { return watch_.is_silent(); }, kDeadlineS));
  EXPECT_NE(Told(), "");
  Heartbeat("ingest");
  ASSERT_TRUE(loop_.RunUntil([&] { return !watch_.is_silent(); }, kDeadlineS));
  EXPECT_EQ(Told(), "skein test: ingest is heard again\n");
}

TEST_F(IngestWatchTest, AnotherServiceIsNoSign) {
  loop_.AddTimer(kSilentS / 10, [&] { Heartbeat("matching"); });
  EXPECT_TRUE(loop_.RunUntil([&] { return watch_.is_silent(); }, kDeadlineS));
}

}  // namespace skein::ingest_watch_test
