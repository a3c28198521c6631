#include "clients/ingest_watch.h"

#include <gtest/gtest.h>

#include <sstream>

#include "testing/test_node.h"

namespace skein::ingest_watch_test {

constexpr double kDeadlineS = 20;
constexpr double kSilentS = 0.2;

class IngestWatchTest : public testing::Test {
 protected:
  void Heartbeat(const std::string& service, const std::string& problem = "") {
    heartbeat_t heartbeat{};
    heartbeat.service = service;
    heartbeat.host = "laptop";
    heartbeat.problem = problem;
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
  EXPECT_EQ(told.rfind("skein test: no answer on ", 0), 0u) << told;
  EXPECT_NE(told.find("`skein launch`"), std::string::npos) << told;
  EXPECT_EQ(Told(), "");
}

TEST_F(IngestWatchTest, TellsThatIngestIsHeardAgain) {
  ASSERT_TRUE(loop_.RunUntil([&] { return watch_.is_silent(); }, kDeadlineS));
  EXPECT_NE(Told(), "");
  Heartbeat("ingest");
  ASSERT_TRUE(loop_.RunUntil([&] { return !watch_.is_silent(); }, kDeadlineS));
  EXPECT_EQ(Told(), "skein test: the session answers again\n");
}

TEST_F(IngestWatchTest, TellsAFullDiskOnceWhateverItsFiguresAndThatItIsOver) {
  const auto told_after = [&](const std::string& problem) {
    Heartbeat("ingest", problem);
    loop_.RunUntil([] { return false; }, kSilentS / 10);
    return Told();
  };
  EXPECT_EQ(told_after("full: 3 MB\nMake room"), "skein test: On laptop: full: 3 MB. Make room.\n");
  EXPECT_EQ(told_after("full: 2 MB\nMake room"), "");
  EXPECT_EQ(told_after(""), "skein test: over: On laptop: full: 3 MB.\n");
}

TEST_F(IngestWatchTest, AnotherServiceIsNoSign) {
  loop_.AddTimer(kSilentS / 10, [&] { Heartbeat("matching"); });
  EXPECT_TRUE(loop_.RunUntil([&] { return watch_.is_silent(); }, kDeadlineS));
}

}  // namespace skein::ingest_watch_test
