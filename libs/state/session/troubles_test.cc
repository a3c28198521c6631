#include "session/troubles.h"

#include <gtest/gtest.h>

namespace skein::troubles_test {

constexpr double kNowS = 100;

HeardProcess Heard(const std::string& service, double heard_s = kNowS - 1) {
  HeardProcess process;
  process.heartbeat.service = service;
  process.heartbeat.instance = service + "-1";
  process.heartbeat.host = "laptop";
  process.heard_s = heard_s;
  return process;
}

HeardProcesses AllProcesses() {
  HeardProcesses processes;
  for (const char* service : {"ingest", "features", "retrieval", "matching", "mapper"}) {
    processes[service] = Heard(service);
  }
  return processes;
}

SessionState WithOnePhoto() {
  SessionState state;
  image_t image{};
  image.header.seq = 1;
  image.image_id = 1;
  image.agent = "alice";
  image.name = "a.jpg";
  state.Apply(image);
  return state;
}

std::vector<std::string> Told(const SessionState& state, const HeardProcesses& processes,
                              double listened_s = 60) {
  std::vector<std::string> told;
  for (const Trouble& trouble : FindTroubles(state, processes, kNowS, listened_s)) {
    EXPECT_FALSE(trouble.remedy.empty());
    told.push_back(trouble.what);
  }
  return told;
}

TEST(Troubles, AreNoneWhereAllRuns) { EXPECT_TRUE(Told(WithOnePhoto(), AllProcesses()).empty()); }

TEST(Troubles, AFullDiskIsToldInTheServicesWords) {
  HeardProcesses processes = AllProcesses();
  processes["ingest"].heartbeat.problem =
      "the disk is almost full: 3 MB are free\nMake room on /data";
  const Trouble trouble = FindTroubles({}, processes, kNowS, 60).at(0);
  EXPECT_EQ(trouble.what, "On laptop: the disk is almost full: 3 MB are free.");
  EXPECT_EQ(trouble.remedy, "Make room on /data.");
}

TEST(Troubles, AProblemWithoutARemedyNamesItsServiceAndSaysThatNothingIsLost) {
  heartbeat_t heartbeat{};
  heartbeat.service = "scale";
  heartbeat.host = "laptop";
  heartbeat.problem = "slurm: no right";
  EXPECT_EQ(TroubleOf(heartbeat).what, "On laptop (scale): slurm: no right.");
  EXPECT_NE(TroubleOf(heartbeat).remedy.find("nothing that was sent is lost"), std::string::npos);
}

TEST(Troubles, ASilentIngestIsToldOnceItWasListenedFor) {
  HeardProcesses processes = AllProcesses();
  processes["ingest"].heard_s = kNowS - kSilentProcessS - 1;
  EXPECT_EQ(Told({}, processes), std::vector<std::string>{IngestIsSilent().what});
  EXPECT_EQ(Told({}, {}), std::vector<std::string>{IngestIsSilent().what});
  EXPECT_TRUE(Told({}, {}, kSilentProcessS - 1).empty());
}

TEST(Troubles, AMissingWorkerIsToldWherePhotosWaitForIt) {
  HeardProcesses processes = AllProcesses();
  processes.erase("features");
  EXPECT_TRUE(Told({}, processes).empty());
  EXPECT_EQ(Told(WithOnePhoto(), processes),
            std::vector<std::string>{
                "1 photo waits for its features, and no skein-features is running."});
}

TEST(Troubles, MoreMayBeFoundWhereAWorkerThatPhotosWaitForWasNotHeardYet) {
  HeardProcesses processes = AllProcesses();
  const auto may_find_more = [&](const SessionState& state, double listened_s) {
    return MayFindMore(state, processes, kNowS, listened_s);
  };
  EXPECT_FALSE(may_find_more(WithOnePhoto(), 1.5));
  processes.erase("features");
  EXPECT_TRUE(may_find_more(WithOnePhoto(), 1.5));
  EXPECT_FALSE(may_find_more(WithOnePhoto(), kSilentProcessS));
  EXPECT_FALSE(may_find_more({}, 1.5)) << "no photo waits";
}

TEST(Troubles, AStageWithoutAProcessIsLacking) {
  HeardProcesses processes = AllProcesses();
  EXPECT_FALSE(LacksWorker(processes, kNowS));
  processes["mapper"].heard_s = kNowS - kSilentProcessS - 1;
  EXPECT_TRUE(LacksWorker(processes, kNowS));
}

TEST(Troubles, OneKeepsItsKeyWhileItsFiguresChange) {
  HeardProcesses processes = AllProcesses();
  const auto key_of = [&](const char* problem) {
    processes["ingest"].heartbeat.problem = problem;
    return FindTroubles({}, processes, kNowS, 60).at(0).key;
  };
  EXPECT_EQ(key_of("the disk is almost full: 3 MB are free"),
            key_of("the disk is almost full: 2 MB are free"));
}

TEST(Troubles, ClocksThatDiffer) {
  HeardProcesses processes = AllProcesses();
  processes["matching"].clock_ahead_us = -65'000'000;
  processes["features"].clock_ahead_us = 1'000'000;
  EXPECT_EQ(Told({}, processes), std::vector<std::string>{"The clock of laptop is 65 s behind."});
}

}  // namespace skein::troubles_test
