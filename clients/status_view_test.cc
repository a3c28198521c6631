#include "clients/status_view.h"

#include <gtest/gtest.h>

namespace skein {
namespace {

// A session's facts, one after the other, and what the status says of its submaps.
class Session {
 public:
  template <class T>
  void Commit(T fact, const std::string& fact_id) {
    fact.header.seq = state_.head() + 1;
    fact.header.fact_id = fact_id;
    state_.Apply(Fact(fact));
  }
  void Seed(int64_t submap_id) {
    seed_t seed{};
    seed.submap_id = submap_id;
    Commit(seed, "seed/" + std::to_string(submap_id));
  }
  void Submap(int64_t submap_id, int64_t epoch, int8_t state, const std::string& reason = "") {
    submap_t submap{};
    submap.submap_id = submap_id;
    submap.epoch = epoch;
    submap.owner = "mapper-1";
    submap.state = state;
    submap.reason = reason;
    Commit(submap, "submap/" + std::to_string(state_.head()));
  }
  void Merge(int8_t state, int64_t merge_id, int64_t source_id, int64_t target_id) {
    merge_t merge{};
    merge.state = state;
    merge.merge_id = merge_id;
    merge.source_id = source_id;
    merge.target_id = target_id;
    merge.reason = state == merge_t::UNDONE ? "they disagree" : "";
    Commit(merge, "merge/" + std::to_string(state_.head()));
  }
  void Tell(int64_t submap_id, int64_t epoch, int num_images) {
    submap_t status{};
    status.submap_id = submap_id;
    status.epoch = epoch;
    status.state = submap_t::ACTIVE;
    status.num_images = num_images;
    statuses_[submap_id] = status;
  }
  nlohmann::json Status() const { return MakeStatus({"id", state_, {}, statuses_, 0}); }
  std::string Stage(int64_t submap_id) const {
    const nlohmann::json status = Status();
    for (const auto& submap : status["submaps"]) {
      if (submap["id"] == submap_id) return submap["state"];
    }
    return "not shown";
  }

 private:
  SessionState state_;
  std::map<int64_t, submap_t> statuses_;
};

TEST(StatusView, ASubmapIsBornGrowsAndChangesHands) {
  Session session;
  session.Seed(1);
  EXPECT_EQ(session.Stage(1), "waits for a mapper");
  session.Submap(1, 1, submap_t::ASSIGNED);
  EXPECT_EQ(session.Stage(1), "being born");
  session.Tell(1, 1, 0);
  EXPECT_EQ(session.Stage(1), "being born");
  session.Tell(1, 1, 2);
  EXPECT_EQ(session.Stage(1), "growing");
  session.Submap(1, 2, submap_t::ASSIGNED);
  EXPECT_EQ(session.Stage(1), "changing hands");
  session.Tell(1, 2, 0);
  EXPECT_EQ(session.Stage(1), "being restored");
}

TEST(StatusView, TellsWhoIsSilentAndWhoCannotReadItsMessages) {
  const SessionState state;
  std::map<std::string, HeardInstance> instances;
  instances["matching-1"].heartbeat.state = "idle";
  instances["matching-1"].heard_s = 100;
  instances["mapper-1"].heartbeat.state = "idle";
  instances["mapper-1"].heard_s = 90;
  const auto text = [&] { return FormatStatus(MakeStatus({"id", state, instances, {}, 101})); };
  EXPECT_NE(text().find("silent for 11 s"), std::string::npos) << text();
  EXPECT_EQ(text().find("another type"), std::string::npos) << text();
  instances["matching-1"].heartbeat.num_decode_failures = 7;
  EXPECT_NE(text().find("idle; messages of another type or damaged: 7"), std::string::npos)
      << text();
}

TEST(StatusView, SaysWhichSubmapsMergeAndHowThatEnded) {
  Session session;
  for (const int64_t id : {1, 2}) {
    session.Seed(id);
    session.Submap(id, 1, submap_t::ASSIGNED);
    session.Tell(id, 1, 9);
  }
  session.Merge(merge_t::ORDERED, 50, 2, 1);
  EXPECT_EQ(session.Stage(2), "merging into 1");
  EXPECT_EQ(session.Stage(1), "absorbing 2");
  session.Merge(merge_t::UNDONE, 50, 2, 1);
  EXPECT_EQ(session.Stage(2), "growing");
  EXPECT_EQ(session.Status()["merges"]["last_undone"], "2 into 1: they disagree");
  session.Merge(merge_t::ORDERED, 60, 2, 1);
  session.Merge(merge_t::DONE, 60, 2, 1);
  session.Submap(2, 1, submap_t::ENDED, "merged into submap 1");
  EXPECT_EQ(session.Stage(2), "not shown");
  const std::string text = FormatStatus(session.Status());
  EXPECT_NE(text.find("merges  1 done, 1 undone, 0 under way"), std::string::npos) << text;
  EXPECT_NE(text.find("submap 2: merged into submap 1"), std::string::npos) << text;
}

}  // namespace
}  // namespace skein
