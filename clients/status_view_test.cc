#include "clients/status_view.h"

#include <gtest/gtest.h>

#include "testing/test_ledger.h"

namespace skein::status_view_test {

// A session's facts, one after the other, and what the status says of its submaps.
class Session : public TestLedger {
 public:
  void Tell(int64_t submap_id, int64_t epoch, int num_images) {
    submap_status_t status{};
    status.submap_id = submap_id;
    status.epoch = epoch;
    status.state = submap_status_t::ACTIVE;
    status.num_images = num_images;
    statuses_[submap_id] = status;
  }
  nlohmann::json Status() const { return MakeStatus({"id", session(), {}, statuses_, 0}); }
  std::string Stage(int64_t submap_id) const {
    const nlohmann::json status = Status();
    for (const auto& submap : status["submaps"]) {
      if (submap["id"] == submap_id) return submap["state"];
    }
    return "not shown";
  }

 private:
  std::map<int64_t, submap_status_t> statuses_;
};

TEST(StatusView, ASubmapIsBornGrowsAndChangesHands) {
  Session session;
  session.Seed(1, 1, 2);
  EXPECT_EQ(session.Stage(1), "waits for a mapper");
  session.Lease(1, 1);
  EXPECT_EQ(session.Stage(1), "being born");
  session.Tell(1, 1, 0);
  EXPECT_EQ(session.Stage(1), "being born");
  session.Tell(1, 1, 2);
  EXPECT_EQ(session.Stage(1), "growing");
  session.Lease(1, 2);
  EXPECT_EQ(session.Stage(1), "changing hands");
  session.Tell(1, 2, 0);
  EXPECT_EQ(session.Stage(1), "being restored");
}

// 1: placed. 2: waits for its features. 3: matched with nothing. 4: failed. And one was refused.
TEST(StatusView, EachReceivedPhotoIsCountedOnce) {
  TestLedger ledger;
  for (const int64_t id : {1, 3}) {
    ledger.Describe(id, 1);
    ledger.Matches(id, {});
  }
  ledger.Seed(1, 1, 1);
  ledger.Lease(1, 1);
  ledger.Register(1, 1);
  for (const int64_t id : {2, 4}) ledger.Photo(id);
  failure_t failure{};
  failure.image_id = 4;
  failure.stage = "features";
  failure.parked = true;
  ledger.Commit(failure);
  failure.image_id = 0;
  failure.stage = "ingest";
  ledger.Commit(failure);
  const std::string text = FormatStatus(MakeStatus({"id", ledger.session(), {}, {}, 0}));
  EXPECT_NE(text.find("photos  5 received: 1 placed, 1 waiting, 1 not placed, 2 failed\n"),
            std::string::npos)
      << text;
}

// A megabyte is 1e6 bytes, as of disks.
TEST(StatusView, NamesUnitsAndNoPartOfTheLedger) {
  const SessionRecord session;
  HeardProcesses processes;
  processes["matching-1"].heartbeat.memory_bytes = 5'000'000;
  const std::string text = FormatStatus(MakeStatus({"id", session, processes, {}, 1}));
  EXPECT_EQ(text.rfind("session id\n", 0), 0u) << text;
  EXPECT_NE(text.find("process         waiting     done    s each memory MB  state\n"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find(" 5.0  "), std::string::npos) << text;
}

TEST(StatusView, ASubmapTakenOverAfterItsFinalModelIsFinal) {
  Session session;
  session.Seed(1, 1, 2);
  session.Lease(1, 1);
  session.Tell(1, 1, 2);
  session.Model(1, submap_model_t::FINAL);
  EXPECT_EQ(session.Stage(1), "final");
  session.Lease(1, 2);
  session.Tell(1, 2, 2);
  EXPECT_EQ(session.Stage(1), "final");
  session.Model(1, submap_model_t::CHECKPOINT);
  EXPECT_EQ(session.Stage(1), "growing");
}

TEST(StatusView, SaysThatASubmapMayBeBent) {
  Session session;
  session.Seed(1, 1, 2);
  session.Lease(1, 1);
  submap_model_t model{};
  model.submap_id = 1;
  model.check.position_sigma = 0.004;
  session.Commit(model);
  EXPECT_EQ(FormatStatus(session.Status()).find("bent"), std::string::npos);
  model.check.position_sigma = 0.02;
  session.Commit(model);
  const std::string text = FormatStatus(session.Status());
  EXPECT_NE(text.find("map 1 may be bent: expected position error 2.0 %"), std::string::npos)
      << text;
}

TEST(StatusView, TellsWhoIsSilentAndWhoCannotReadItsMessages) {
  const SessionRecord session;
  HeardProcesses instances;
  instances["matching-1"].heartbeat.state = "idle";
  instances["matching-1"].heard_s = 100;
  instances["mapper-1"].heartbeat.state = "idle";
  instances["mapper-1"].heard_s = 90;
  const auto text = [&] { return FormatStatus(MakeStatus({"id", session, instances, {}, 101})); };
  EXPECT_NE(text().find("silent for 11 s"), std::string::npos) << text();
  EXPECT_EQ(text().find("another type"), std::string::npos) << text();
  instances["matching-1"].heartbeat.num_decode_failures = 7;
  instances["matching-1"].heartbeat.num_refused = 5;
  EXPECT_NE(text().find("idle; messages of another type or damaged: 7"), std::string::npos)
      << text();
}

TEST(StatusView, SaysWhichSubmapsMergeAndHowThatEnded) {
  Session session;
  for (const int64_t id : {1, 2}) {
    session.Seed(id, 1, 2);
    session.Lease(id, 1);
    session.Tell(id, 1, 9);
  }
  const int64_t undone = session.Order(2, 1);
  EXPECT_EQ(session.Stage(2), "merging into 1");
  EXPECT_EQ(session.Stage(1), "absorbing 2");
  session.MergeStep(undone, merge_t::UNDONE);
  EXPECT_EQ(session.Stage(2), "growing");
  EXPECT_EQ(session.Status()["merges"]["last_undone"], "2 into 1: they disagree");
  session.MergeStep(session.Order(2, 1), merge_t::DONE);
  session.End(2, "merged into map 1");
  EXPECT_EQ(session.Stage(2), "not shown");
  const std::string text = FormatStatus(session.Status());
  EXPECT_NE(text.find("merges  1 done, 1 undone, 0 under way"), std::string::npos) << text;
  EXPECT_NE(text.find("map 2: merged into map 1"), std::string::npos) << text;
}

}  // namespace skein::status_view_test
