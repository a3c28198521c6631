#include "clients/scale/worker_pool.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "clients/scale/worker_demand.h"

namespace skein::worker_pool_test {

constexpr int64_t kExpiry = 2'000'000'000;

class WorkerPoolTest : public testing::Test {
 protected:
  // Two seconds later.
  WorkerPool::Plan Look(int wanted) {
    now_.monotonic_s += 2;
    now_.utime_s += 2;
    return pool_.Decide(jobs_, heard_, wanted, now_);
  }
  // Until something is decided; nothing within `most_s`: an empty plan.
  WorkerPool::Plan LookUntilDecided(int wanted, double most_s) {
    const double until_s = now_.monotonic_s + most_s;
    while (now_.monotonic_s < until_s) {
      for (auto& [name, worker] : heard_) worker.heard_s = now_.monotonic_s;
      const WorkerPool::Plan plan = Look(wanted);
      if (plan.num_new > 0 || !plan.leaving.empty() || !plan.told.empty()) return plan;
    }
    return {};
  }
  void Run(const std::string& name, int64_t backlog) {
    jobs_.push_back({name, true, ""});
    heard_[name] = {now_.monotonic_s, backlog};
  }

  WorkerPool pool_;
  PoolTime now_{1000, kExpiry - 40'000};
  std::vector<WorkerJob> jobs_;
  HeardWorkers heard_;
  const std::string a_ = WorkerName(kExpiry, 1), b_ = WorkerName(kExpiry, 2),
                    c_ = WorkerName(kExpiry, 3);
};

TEST(WorkerDemand, IsBacklogTimesSecondsOverTarget) {
  EXPECT_EQ(NumWanted(0, 60, 0, 8), 0);
  EXPECT_EQ(NumWanted(60, 60, 0, 8), 1);
  EXPECT_EQ(NumWanted(61, 60, 0, 8), 2);
  EXPECT_EQ(NumWanted(1e12, 60, 0, 8), 8);
  EXPECT_EQ(NumWanted(0, 60, 3, 8), 3);
}

TEST(WorkerDemand, APhotoBeforeFeaturesNeedsMatchingToo) {
  SessionRecord session;
  SessionTally tally;
  const auto commit = [&](auto fact, int64_t image_id) {
    fact.header.seq = session.state.head() + 1;
    fact.header.fact_id = "fact/" + std::to_string(fact.header.seq);
    fact.image_id = image_id;
    session.Apply(fact);
    tally.Apply(fact, session.state);
  };
  for (int64_t id = 1; id <= 3; ++id) commit(image_t{}, id);
  features_t features{};
  features.keypoints_blob = "blob";
  commit(features, 1);
  StageTimes times;
  times.by_stage["features"] = {1, 3};
  times.sum_s["features"] = 4;
  const WorkerDemand demand = DemandOf(tally, times);
  EXPECT_EQ(demand.num_photos, 3);
  EXPECT_DOUBLE_EQ(demand.work_s, 2 * 2.0 + 3 * kUnknownItemS);
}

TEST(WorkerName, TellsWhenItsInvitationEnds) {
  EXPECT_EQ(ExpiryOfWorker(WorkerName(kExpiry, 12)), kExpiry);
  for (const char* other :
       {"", "w", "worker-1", "w77359400", "w77359400-", "w77359400-1x", "w-1"}) {
    EXPECT_EQ(ExpiryOfWorker(other), 0) << other;
  }
}

TEST_F(WorkerPoolTest, GrowsOnceTheBacklogHasStayed) {
  EXPECT_EQ(Look(3).num_new, 0);
  EXPECT_EQ(Look(0).num_new, 0);
  EXPECT_EQ(Look(3).num_new, 0);
  EXPECT_EQ(LookUntilDecided(3, 10).num_new, 3);
}

TEST_F(WorkerPoolTest, CountsWhatItSubmittedBeforeItIsListed) {
  pool_.OnSubmitted({a_, b_}, Status::Ok(), now_.monotonic_s);
  EXPECT_EQ(LookUntilDecided(2, 10).num_new, 0);
  EXPECT_EQ(pool_.num_waiting(), 2);
}

TEST_F(WorkerPoolTest, SpareWorkersLeaveLateAndIdleOnesFirst) {
  jobs_.push_back({a_, false, "Resources"});
  Run(b_, 4);
  Run(c_, 0);
  EXPECT_TRUE(LookUntilDecided(1, 58).leaving.empty());
  EXPECT_EQ(LookUntilDecided(1, 10).leaving, (std::vector<std::string>{a_, c_}));
  EXPECT_EQ(pool_.num_running(), 1);
}

TEST_F(WorkerPoolTest, ARefusedCancellationIsTriedAgainLaterAndLater) {
  const std::vector<std::string> spare = {a_};
  Run(a_, 0);
  EXPECT_EQ(LookUntilDecided(0, 70).leaving, spare);
  pool_.OnCancelled(spare, Unavailable("no answer"), now_.monotonic_s);
  EXPECT_EQ(pool_.uncancelled(), "no answer");
  EXPECT_EQ(pool_.problem(), "");
  EXPECT_TRUE(LookUntilDecided(0, 8).leaving.empty());
  EXPECT_EQ(LookUntilDecided(0, 4).leaving, spare);
  pool_.OnCancelled(spare, Unavailable("no answer"), now_.monotonic_s);
  EXPECT_TRUE(LookUntilDecided(0, 18).leaving.empty());
  EXPECT_EQ(LookUntilDecided(0, 4).leaving, spare);
  pool_.OnCancelled(spare, Status::Ok(), now_.monotonic_s);
  EXPECT_EQ(pool_.uncancelled(), "");
  EXPECT_TRUE(LookUntilDecided(0, 400).leaving.empty());
}

TEST_F(WorkerPoolTest, AWorkerThatEndsInSpiteOfARefusalIsNotCancelledAgain) {
  Run(a_, 0);
  EXPECT_EQ(LookUntilDecided(0, 70).leaving, (std::vector<std::string>{a_}));
  pool_.OnCancelled({a_}, Unavailable("no answer"), now_.monotonic_s);
  jobs_.clear();
  EXPECT_TRUE(LookUntilDecided(0, 400).leaving.empty());
  EXPECT_EQ(pool_.uncancelled(), "");
}

TEST_F(WorkerPoolTest, AShortLullLetsNobodyGo) {
  Run(a_, 0);
  EXPECT_TRUE(LookUntilDecided(0, 50).leaving.empty());
  EXPECT_TRUE(Look(1).leaving.empty());
  EXPECT_TRUE(LookUntilDecided(0, 50).leaving.empty());
}

TEST_F(WorkerPoolTest, ASilentWorkerIsReplaced) {
  Run(a_, 2);
  EXPECT_TRUE(LookUntilDecided(1, 100).leaving.empty());
  now_.monotonic_s += 61;
  const WorkerPool::Plan plan = Look(1);
  EXPECT_EQ(plan.leaving, (std::vector<std::string>{a_}));
  EXPECT_NE(plan.told.at(0).find("its node may be down"), std::string::npos);
  jobs_.clear();
  heard_.clear();
  EXPECT_EQ(LookUntilDecided(1, 10).num_new, 1);
}

TEST_F(WorkerPoolTest, AnInvitationThatEndsInTheQueueIsReplaced) {
  jobs_.push_back({a_, false, "Priority"});
  Look(1);
  now_.utime_s = kExpiry - 30;
  const WorkerPool::Plan plan = Look(1);
  EXPECT_EQ(plan.leaving, (std::vector<std::string>{a_}));
  EXPECT_NE(plan.told.at(0).find("ended while it waited"), std::string::npos);
  EXPECT_EQ(LookUntilDecided(1, 10).num_new, 1);
}

TEST_F(WorkerPoolTest, ARunningWorkerStaysUntilItsInvitationEnds) {
  Run(a_, 0);
  now_.utime_s = kExpiry - 20;
  EXPECT_TRUE(LookUntilDecided(1, 10).leaving.empty());
  now_.utime_s = kExpiry + 1;
  EXPECT_EQ(Look(1).leaving, (std::vector<std::string>{a_}));
}

TEST_F(WorkerPoolTest, AQueueThatDoesNotStartIsTold) {
  jobs_.push_back({a_, false, "PartitionDown"});
  LookUntilDecided(1, 119);
  EXPECT_EQ(pool_.problem(), "");
  LookUntilDecided(1, 5);
  EXPECT_NE(pool_.problem().find("(PartitionDown)"), std::string::npos);
  jobs_[0].is_running = true;
  heard_[a_] = {now_.monotonic_s, 0};
  Look(1);
  EXPECT_EQ(pool_.problem(), "");
}

TEST_F(WorkerPoolTest, RefusalsAreToldAndTriedAgainLaterAndLater) {
  EXPECT_EQ(LookUntilDecided(1, 10).num_new, 1);
  pool_.OnSubmitted({a_}, Unavailable("no right"), now_.monotonic_s);
  EXPECT_EQ(pool_.problem(), "no right");
  EXPECT_EQ(LookUntilDecided(1, 8).num_new, 0);
  EXPECT_EQ(LookUntilDecided(1, 4).num_new, 1);
  pool_.OnSubmitted({a_}, Unavailable("no right"), now_.monotonic_s);
  EXPECT_EQ(LookUntilDecided(1, 18).num_new, 0);
  EXPECT_EQ(LookUntilDecided(1, 4).num_new, 1);
  pool_.OnSubmitted({a_}, Status::Ok(), now_.monotonic_s);
  EXPECT_EQ(pool_.problem(), "");
}

TEST_F(WorkerPoolTest, JobsThatEndUnheardAreToldAndNotSubmittedInALoop) {
  jobs_.push_back({a_, true, ""});
  Look(1);
  jobs_.clear();
  EXPECT_NE(Look(1).told.at(0).find("ended before it was heard"), std::string::npos);
  EXPECT_EQ(LookUntilDecided(1, 7).num_new, 0);
  EXPECT_EQ(LookUntilDecided(1, 4).num_new, 1);
}

TEST_F(WorkerPoolTest, AWorkerThatEndsByItselfIsTold) {
  Run(a_, 0);
  Look(1);
  jobs_.clear();
  EXPECT_NE(Look(1).told.at(0).find("was not told to"), std::string::npos);
}

}  // namespace skein::worker_pool_test
