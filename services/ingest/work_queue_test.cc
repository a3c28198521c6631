#include "ingest/work_queue.h"

#include <gtest/gtest.h>

#include <csignal>

namespace skein::work_queue_test {

using Request = WorkQueue::Request;

std::vector<int64_t> Items(const std::vector<WorkQueue::Grant>& grants) {
  std::vector<int64_t> items;
  for (const auto& grant : grants) items.push_back(grant.item);
  return items;
}

// The worker takes what it is given and is told of a death while it works on `item`.
std::vector<WorkQueue::Failure> DieOn(WorkQueue* queue, int64_t item, int signal, double now_s) {
  queue->OnRequest({"w", 0, 0, {item}}, now_s);
  return queue->OnRequest({"w", 1, signal, {}}, now_s + 0.1);
}

TEST(WorkQueue, PushesTheOldestItemsToWhoCanTakeThem) {
  WorkQueue queue;
  queue.OnRequest({"w", 2, 0, {}}, 0);
  for (const int64_t item : {5, 3, 4}) queue.Add(item);
  EXPECT_EQ(Items(queue.Assign(0)), (std::vector<int64_t>{3, 4}));
  EXPECT_TRUE(queue.Assign(0.1).empty());
  queue.OnRequest({"w", 1, 0, {4}}, 0.2);  // 3 is done
  queue.Remove(3);
  EXPECT_EQ(Items(queue.Assign(0.2)), (std::vector<int64_t>{5}));
}

TEST(WorkQueue, SpreadsItemsOverWorkers) {
  WorkQueue queue;
  queue.OnRequest({"a", 4, 0, {}}, 0);
  queue.OnRequest({"b", 4, 0, {}}, 0);
  for (int64_t item = 1; item <= 4; ++item) queue.Add(item);
  int of_a = 0;
  for (const auto& grant : queue.Assign(0)) of_a += grant.worker == "a";
  EXPECT_EQ(of_a, 2);
}

TEST(WorkQueue, TellsALostGrantAgain) {
  WorkQueue queue;
  queue.OnRequest({"w", 1, 0, {}}, 0);
  queue.Add(1);
  EXPECT_EQ(queue.Assign(0).size(), 1u);
  queue.OnRequest({"w", 1, 0, {}}, 1);  // it never arrived
  EXPECT_EQ(Items(queue.Assign(1)), (std::vector<int64_t>{1}));
  queue.OnRequest({"w", 0, 0, {1}}, 1.1);
  EXPECT_TRUE(queue.Assign(2).empty());
}

TEST(WorkQueue, AWorkerThatLeavesGivesBackWhatItWasJustGranted) {
  WorkQueue queue;
  queue.OnRequest({"leaving", 1, 0, {}}, 0);
  queue.Add(1);
  EXPECT_EQ(Items(queue.Assign(0)), (std::vector<int64_t>{1}));
  queue.OnRequest({"leaving", 0, 0, {}}, 0.1);
  EXPECT_EQ(queue.num_waiting(), 1u);
  queue.OnRequest({"other", 1, 0, {}}, 0.2);
  const auto grants = queue.Assign(0.2);
  ASSERT_EQ(grants.size(), 1u);
  EXPECT_EQ(grants[0].worker, "other");
}

TEST(WorkQueue, AWorkerThatLeavesGivesBackAllThatItHolds) {
  WorkQueue queue;
  queue.OnRequest({"leaving", 2, 0, {}}, 0);
  for (const int64_t item : {1, 2}) queue.Add(item);
  queue.Assign(0);
  queue.OnRequest({"leaving", 0, 0, {1, 2}}, 0.1);
  EXPECT_TRUE(queue.OnRequest({"leaving", -1, 0, {}}, 0.2).empty());
  EXPECT_TRUE(queue.Assign(0.2).empty());
  queue.OnRequest({"other", 2, 0, {}}, 0.3);
  const auto grants = queue.Assign(0.3);
  ASSERT_EQ(Items(grants), (std::vector<int64_t>{1, 2}));
  EXPECT_EQ(grants[0].worker, "other");
  EXPECT_EQ(grants[0].attempt, 1);
}

// A process that comes under its name begins anew.
TEST(WorkQueue, AWorkerThatLeftMayComeBack) {
  WorkQueue queue;
  queue.OnRequest({"w", 1, 0, {}}, 0);
  queue.Add(1);
  queue.Assign(0);
  queue.OnRequest({"w", -1, 0, {}}, 0.1);
  queue.OnRequest({"w", 1, 0, {}}, 0.2);
  EXPECT_EQ(Items(queue.Assign(0.2)), (std::vector<int64_t>{1}));
}

TEST(WorkQueue, AFullWorkerKeepsWhatItHolds) {
  WorkQueue queue;
  queue.OnRequest({"w", 2, 0, {}}, 0);
  for (const int64_t item : {1, 2}) queue.Add(item);
  EXPECT_EQ(queue.Assign(0).size(), 2u);
  queue.OnRequest({"w", 0, 0, {1, 2}}, 0.1);
  queue.OnRequest({"w", 0, 0, {1, 2}}, 5);
  EXPECT_EQ(queue.num_waiting(), 0u);
  EXPECT_TRUE(queue.Assign(8).empty());
}

TEST(WorkQueue, LeaseLapsesUnlessRenewed) {
  WorkQueue queue;
  queue.OnRequest({"a", 1, 0, {}}, 0);
  queue.Add(1);
  queue.Assign(0);
  for (double now = 1; now <= 20; ++now) queue.OnRequest({"a", 0, 0, {1}}, now);
  queue.OnRequest({"b", 1, 0, {}}, 25);
  EXPECT_TRUE(queue.Assign(25.9).empty());
  const auto grants = queue.Assign(26.1);
  ASSERT_EQ(grants.size(), 1u);
  EXPECT_EQ(grants[0].worker, "b");
  EXPECT_EQ(grants[0].attempt, 1);  // a lapse is no failure
}

TEST(WorkQueue, GivesNothingToAWorkerThatWentSilent) {
  WorkQueue queue;
  queue.OnRequest({"w", 1, 0, {}}, 0);
  queue.Add(1);
  EXPECT_TRUE(queue.Assign(7).empty());
}

TEST(WorkQueue, WhatASilentWorkerNeverTookGoesToAnother) {
  WorkQueue queue;
  queue.OnRequest({"hung", 1, 0, {}}, 0);
  queue.Add(1);
  EXPECT_EQ(queue.Assign(0.5).at(0).worker, "hung");
  queue.OnRequest({"other", 1, 0, {}}, 2.9);
  for (const auto& grant : queue.Assign(2.9)) EXPECT_FALSE(grant.is_new) << "it may be on its way";
  const auto grants = queue.Assign(3.1);
  ASSERT_EQ(grants.size(), 1u);
  EXPECT_EQ(grants[0].worker, "other");
  EXPECT_EQ(grants[0].attempt, 1);
  queue.OnRequest({"other", 0, 0, {1}}, 3.2);
  queue.OnRequest({"hung", 0, 0, {1}}, 3.3);
  EXPECT_EQ(queue.num_leased(), 1u);
  EXPECT_TRUE(queue.OnFailed("hung", 1, "too late", false, 3.4).empty()) << "it is another's";
}

TEST(WorkQueue, ASilentWorkerKeepsWhatItTookUntilTheLeaseLapses) {
  WorkQueue queue;
  queue.Add(1);
  queue.OnRequest({"held up", 0, 0, {1}}, 0);
  queue.OnRequest({"other", 1, 0, {}}, 5.9);
  EXPECT_TRUE(queue.Assign(5.9).empty());
  queue.OnRequest({"held up", 0, 0, {1}}, 5.95);
  EXPECT_TRUE(queue.Assign(6.1).empty());
}

TEST(WorkQueue, WhatTheLedgerSaysIsKeptForAWorkerThatHasNotAskedYet) {
  WorkQueue queue;
  queue.Add(1);
  queue.Lease(1, "mapper", 0);
  queue.OnRequest({"other", 1, 0, {}}, 5.9);
  for (const auto& grant : queue.Assign(5.9)) EXPECT_EQ(grant.worker, "mapper");
  queue.OnRequest({"other", 1, 0, {}}, 6.1);
  EXPECT_EQ(queue.Assign(6.1).at(0).worker, "other");
}

TEST(WorkQueue, GivesAWorkerBackWhatItHeldBeforeIngestRestarted) {
  WorkQueue queue;
  queue.Add(1);
  queue.OnRequest({"a", 0, 0, {1}}, 0);
  queue.OnRequest({"b", 1, 0, {}}, 0);
  EXPECT_TRUE(queue.Assign(0).empty());
  EXPECT_EQ(queue.num_leased(), 1u);
}

TEST(WorkQueue, LetsOnlyTheOwnerGoOnWithASubmap) {
  const std::string owner = "owner";
  WorkQueue queue({}, [&](const std::string& worker, int64_t) { return worker == owner; });
  queue.Add(1);
  queue.OnRequest({"late", 0, 0, {1}}, 0);
  EXPECT_EQ(queue.num_leased(), 0u);
  queue.OnRequest({"owner", 0, 0, {1}}, 0);
  EXPECT_EQ(queue.num_leased(), 1u);
}

TEST(WorkQueue, ParksAfterThreeReportedErrors) {
  WorkQueue queue;
  queue.OnRequest({"w", 1, 0, {}}, 0);
  queue.Add(1);
  for (int i = 1; i <= 3; ++i) {
    const double now = i * 3;
    queue.OnRequest({"w", 1, 0, {}}, now);
    const auto grants = queue.Assign(now);
    ASSERT_EQ(grants.size(), 1u);
    EXPECT_EQ(grants[0].attempt, i);
    const auto failures = queue.OnFailed("w", 1, "cannot decode", false, now + 0.1);
    ASSERT_EQ(failures.size(), 1u);
    EXPECT_EQ(failures[0].attempts, i);
    EXPECT_EQ(failures[0].parked, i == 3);
    EXPECT_TRUE(queue.OnFailed("w", 1, "cannot decode", false, now + 0.2).empty()) << "repeated";
    EXPECT_TRUE(queue.Assign(now + 0.3).empty()) << "before the delay is over";
  }
  EXPECT_FALSE(queue.Has(1));
}

TEST(WorkQueue, ParksAtOnceWhatCannotBeHelped) {
  WorkQueue queue;
  queue.OnRequest({"w", 1, 0, {}}, 0);
  queue.Add(1);
  queue.Assign(0);
  EXPECT_TRUE(queue.OnFailed("w", 1, "no such model", true, 1).at(0).parked);
}

TEST(WorkQueue, RemembersFailuresOfBeforeARestart) {
  WorkQueue queue;
  queue.OnRequest({"w", 1, 0, {}}, 0);
  queue.Add(1);
  queue.NoteEarlier(1, 2);
  EXPECT_EQ(queue.Assign(0).at(0).attempt, 3);
  EXPECT_TRUE(queue.OnFailed("w", 1, "again", false, 1).at(0).parked);
}

TEST(WorkQueue, ParksAfterThreeCrashesOnOneItem) {
  WorkQueue queue;
  queue.Add(1);
  EXPECT_FALSE(DieOn(&queue, 1, SIGSEGV, 0).at(0).parked);
  EXPECT_FALSE(DieOn(&queue, 1, SIGABRT, 10).at(0).parked);
  const auto failures = DieOn(&queue, 1, SIGBUS, 20);
  ASSERT_EQ(failures.size(), 1u);
  EXPECT_TRUE(failures[0].parked);
  EXPECT_EQ(failures[0].reason, "worker died of SIGBUS");
}

TEST(WorkQueue, ParksWhatThreeWorkersHungOn) {
  WorkQueue queue;
  queue.Add(1);
  EXPECT_FALSE(DieOn(&queue, 1, SIGALRM, 0).at(0).parked);
  EXPECT_FALSE(DieOn(&queue, 1, SIGALRM, 10).at(0).parked);
  const auto failures = DieOn(&queue, 1, SIGALRM, 20);
  ASSERT_EQ(failures.size(), 1u);
  EXPECT_TRUE(failures[0].parked);
  EXPECT_EQ(failures[0].reason, "worker died of SIGALRM: its job made no progress");
}

TEST(WorkQueue, BlamesOnlyTheItemThatWasWorkedOn) {
  WorkQueue queue;
  queue.Add(1);
  queue.Add(2);
  queue.OnRequest({"w", 0, 0, {1, 2}}, 0);
  const auto failures = queue.OnRequest({"w", 2, SIGSEGV, {}}, 1);
  ASSERT_EQ(failures.size(), 1u);
  EXPECT_EQ(failures[0].item, 1);
  EXPECT_EQ(Items(queue.Assign(1)), (std::vector<int64_t>{2})) << "free at once";
  EXPECT_TRUE(queue.OnRequest({"w", 1, SIGSEGV, {2}}, 2).empty()) << "the same death told again";
}

TEST(WorkQueue, GrantsAllThatAKilledWorkerHeldAnewAsThereIsRoom) {
  WorkQueue queue;
  for (const int64_t item : {1, 2, 3}) queue.Add(item);
  queue.OnRequest({"w", 0, 0, {2, 1, 3}}, 0);
  EXPECT_TRUE(queue.OnRequest({"w", 1, SIGKILL, {}}, 1).empty());
  EXPECT_EQ(Items(queue.Assign(1)), (std::vector<int64_t>{1}));
  EXPECT_EQ(queue.num_waiting(), 2u);
  queue.OnRequest({"other", 1, 0, {}}, 2);
  queue.OnRequest({"w", 1, SIGKILL, {1}}, 2);
  EXPECT_EQ(Items(queue.Assign(2)), (std::vector<int64_t>{2, 3}));
}

TEST(WorkQueue, CountsACrashEvenWhenTheLeaseHasLapsed) {
  WorkQueue queue;
  queue.Add(1);
  queue.OnRequest({"w", 0, 0, {1}}, 0);
  queue.Assign(60);
  EXPECT_EQ(queue.OnRequest({"w", 1, SIGSEGV, {}}, 61).size(), 1u);
}

TEST(WorkQueue, DoesNotBlameItemsForHealthyWorkersThatAreKilled) {
  WorkQueue queue;
  queue.Add(1);
  for (int i = 0; i < 9; ++i) EXPECT_TRUE(DieOn(&queue, 1, SIGKILL, i * 10).empty());
  for (int i = 9; i < 30; ++i) EXPECT_TRUE(DieOn(&queue, 1, SIGTERM, i * 10).empty());
  const auto failures = DieOn(&queue, 1, SIGKILL, 400);
  ASSERT_EQ(failures.size(), 1u);
  EXPECT_TRUE(failures[0].parked);
  EXPECT_EQ(failures[0].reason, "kills its worker (out of memory?)");
}

TEST(WorkQueue, IgnoresReportsOfWhoHoldsNothing) {
  WorkQueue queue;
  queue.Add(1);
  EXPECT_TRUE(queue.OnFailed("unknown", 1, "x", true, 0).empty());
  EXPECT_TRUE(queue.OnFailed("unknown", 99, "x", true, 0).empty());
  EXPECT_TRUE(queue.Has(1));
}

}  // namespace skein::work_queue_test
