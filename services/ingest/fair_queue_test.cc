#include "ingest/fair_queue.h"

#include <gtest/gtest.h>

#include <map>

namespace skein::fair_queue_test {

class FairJobQueueTest : public testing::Test {
 protected:
  void Add(const std::string& party, int num_jobs, double seconds) {
    for (int i = 0; i < num_jobs; ++i) {
      queue_.Add(party, [this, party, seconds] {
        order_ += party;
        had_s_[party] += seconds;
        queue_.NoteWork(party, seconds);
      });
    }
  }
  void RunFor(int num_jobs) {
    for (int i = 0; i < num_jobs; ++i) {
      auto next = queue_.Take();
      if (!next) return;
      next->job();
    }
  }

  FairJobQueue queue_;
  std::string order_;
  std::map<std::string, double> had_s_;
};

TEST_F(FairJobQueueTest, AloneAPartyHasAll) {
  Add("a", 3, 1);
  RunFor(10);
  EXPECT_EQ(order_, "aaa");
  EXPECT_FALSE(queue_.Take());
}

TEST_F(FairJobQueueTest, PartiesWithEqualJobsTakeTurns) {
  Add("a", 4, 1);
  Add("b", 4, 1);
  Add("c", 4, 1);
  RunFor(12);
  EXPECT_EQ(order_, "abcabcabcabc");
}

TEST_F(FairJobQueueTest, SlowJobsDelayTheirOwnPartyOnly) {
  Add("slow", 16, 100);
  RunFor(1);
  Add("fast", 50, 1);
  RunFor(51);
  EXPECT_EQ(had_s_["fast"], 50) << "all, while the slow party has had more";
  EXPECT_EQ(had_s_["slow"], 200);
}

TEST_F(FairJobQueueTest, WhoComesLaterHasNoTimeSavedUp) {
  Add("a", 10, 1);
  RunFor(8);
  Add("b", 10, 1);
  order_.clear();
  RunFor(4);
  EXPECT_EQ(order_, "baba");
}

TEST_F(FairJobQueueTest, ForgetsPartiesThatHaveNothingToDo) {
  for (int i = 0; i < 100; ++i) {
    Add(std::to_string(i), 1, 1);
    RunFor(1);
  }
  Add("last", 2, 1);
  RunFor(2);
  EXPECT_FALSE(queue_.Take());
  EXPECT_LT(queue_.num_parties(), 5u);
}

}  // namespace skein::fair_queue_test
