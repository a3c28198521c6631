#include "clients/trouble_watch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <string>

#include "core/clock.h"
#include "testing/test_node.h"

namespace skein::trouble_watch_test {

constexpr double kDeadlineS = 20;

// The session's processes, played by the test; an agent listens.
class TroubleWatchTest : public testing::Test {
 protected:
  TroubleWatchTest() {
    for (const char* service : {"ingest", "features", "retrieval", "matching", "mapper"}) {
      beats_[service].service = service;
      beats_[service].instance = std::string(service) + "-1";
      beats_[service].host = "laptop";
    }
  }
  // Seconds later, in which all processes that are left were heard. Returns the agent's lines.
  std::string ToldAfter(double seconds) {
    ahead_s_ += seconds;
    for (auto& [service, beat] : beats_) {
      beat.utime_us = NowUs() + behind_us_;
      session_.Publish(kHeartbeatChannel, beat);
    }
    bool passed = false;
    loop_.AddOneShot(0.05, [&] { passed = true; });
    EXPECT_TRUE(loop_.RunUntil([&] { return passed; }, kDeadlineS));
    std::ostringstream told;
    watch_.TellChange("skein agent", told);
    return told.str();
  }
  // The first line that comes, while heartbeats go on.
  std::string Told() {
    const double until_s = MonotonicS() + kDeadlineS;
    while (MonotonicS() < until_s) {
      if (const std::string told = ToldAfter(0); !told.empty()) return told;
    }
    return "";
  }
  void AddPhoto(int64_t image_id) {
    image_t image{};
    image.header.fact_id = "image/" + std::to_string(image_id);
    image.image_id = image_id;
    image.agent = "alice";
    image.name = std::to_string(image_id) + ".jpg";
    ingest_.Commit(image);
  }

  double ahead_s_ = 0;
  int64_t behind_us_ = 0;  // added to the processes' clock
  PollLoop loop_{[this] { return MonotonicS() + ahead_s_; }};
  Bus bus_{"memq://", loop_};
  Node session_{TestOptions("ingest-by-hand"), loop_, bus_};
  Node node_{TestOptions("agent.alice"), loop_, bus_};
  MemoryIngest ingest_{session_};
  TroubleWatch watch_{node_};
  std::map<std::string, heartbeat_t> beats_;
};

TEST_F(TroubleWatchTest, TellsNothingWhereAllRuns) {
  AddPhoto(1);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(ToldAfter(3), "");
}

TEST_F(TroubleWatchTest, TellsAFullDiskOnceWhateverItsFigures) {
  beats_["ingest"].problem = "the disk is almost full: 3 MB are free\nMake room on /data";
  EXPECT_EQ(ToldAfter(1),
            "skein agent: On laptop: the disk is almost full: 3 MB are free. Make room on "
            "/data.\n");
  beats_["ingest"].problem = "the disk is almost full: 2 MB are free\nMake room on /data";
  EXPECT_EQ(ToldAfter(1), "");
  beats_["ingest"].problem = "";
  EXPECT_EQ(ToldAfter(1),
            "skein agent: over: On laptop: the disk is almost full: 3 MB are free.\n");
}

TEST_F(TroubleWatchTest, TellsThatIngestIsSilentAndWhereItWasListenedFor) {
  beats_.erase("ingest");
  EXPECT_EQ(ToldAfter(1), "") << "it may still be heard";
  const std::string told = ToldAfter(kSilentProcessS);
  EXPECT_EQ(told.rfind("skein agent: " + IngestIsSilent().what + " ", 0), 0u) << told;
  EXPECT_NE(told.find("no answer on "), std::string::npos) << told;
  EXPECT_EQ(ToldAfter(1), "");
}

TEST_F(TroubleWatchTest, TellsAMissingWorkerOncePhotosWaitForIt) {
  beats_.erase("features");
  EXPECT_EQ(ToldAfter(kSilentProcessS + 1), "");
  AddPhoto(1);
  const std::string told = Told();
  const std::string what = "1 photo waits for its features, and no skein-features is running.";
  EXPECT_EQ(told.rfind("skein agent: " + what + " Start ", 0), 0u) << told;
  AddPhoto(2);
  EXPECT_EQ(ToldAfter(1), "");
  beats_["features"].service = "features";
  beats_["features"].instance = "features-2";
  EXPECT_EQ(Told(), "skein agent: over: " + what + "\n");
}

TEST_F(TroubleWatchTest, TellsClocksApartOnceAHost) {
  behind_us_ = -65'500'000;
  const std::string told = ToldAfter(1);
  EXPECT_EQ(told.rfind("skein agent: The clock of laptop is 65 s behind. ", 0), 0u) << told;
  EXPECT_EQ(std::count(told.begin(), told.end(), '\n'), 1) << told;
}

}  // namespace skein::trouble_watch_test
