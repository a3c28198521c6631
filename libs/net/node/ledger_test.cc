#include <gtest/gtest.h>

#include <set>
#include <stdexcept>
#include <string>

#include "core/attempt.h"
#include "ledger/ledger_range.h"
#include "node/ledger_follower.h"
#include "testing/test_node.h"

namespace skein::ledger_test {

class LedgerTest : public testing::Test {
 protected:
  PollLoop loop_;
  Bus bus_{"memq://", loop_};
  Node ingest_node_{TestOptions("ingest"), loop_, bus_};
  Node node_{TestOptions("worker"), loop_, bus_};
  MemoryIngest ingest_{ingest_node_};
};

// What a follower delivered, checked to be 1, 2, 3, ...
struct Delivered {
  void operator()(const Fact& fact) { seqs.push_back(Header(fact).seq); }
  void ExpectAllFrom(int64_t first, size_t count) const {
    ASSERT_EQ(seqs.size(), count);
    for (size_t i = 0; i < count; ++i) EXPECT_EQ(seqs[i], first + static_cast<int64_t>(i));
  }
  std::vector<int64_t> seqs;
};

TEST_F(LedgerTest, FollowerKnowsAtOnceThatAnEmptyLedgerIsEmpty) {
  LedgerFollower follower(node_, 1, [](const Fact&) {});
  EXPECT_FALSE(follower.caught_up());
  ASSERT_TRUE(loop_.RunUntil([&] { return follower.caught_up(); }, 10));
  EXPECT_EQ(follower.head_seq(), 0);
}

TEST_F(LedgerTest, FollowerDeliversInOrderOnce) {
  Delivered delivered;
  LedgerFollower follower(node_, 1, std::ref(delivered));
  for (int i = 0; i < 50; ++i) ingest_.Commit(TestFact("a/" + std::to_string(i)));
  ASSERT_TRUE(loop_.RunUntil([&] { return follower.processed_seq() == 50; }, 10));
  delivered.ExpectAllFrom(1, 50);
  EXPECT_TRUE(follower.caught_up());
}

TEST_F(LedgerTest, AnExceptionAtAFactIsNotedAndTheNextIsDelivered) {
  Delivered delivered;
  LedgerFollower follower(node_, 1, [&](const Fact& fact) {
    delivered(fact);
    if (Header(fact).seq == 2) throw std::runtime_error("no such photo");
  });
  for (const char* id : {"a/1", "a/2", "a/3"}) ingest_.Commit(TestFact(id));
  ASSERT_TRUE(loop_.RunUntil([&] { return follower.processed_seq() == 3; }, 10));
  delivered.ExpectAllFrom(1, 3);
  EXPECT_EQ(loop_.thrown().count, 1);
  EXPECT_EQ(loop_.thrown().last, "fact a/2: no such photo");
  std::string problem;
  bus_.Subscribe(kHeartbeatChannel, [&](const heartbeat_t& beat) { problem = beat.problem; });
  ASSERT_TRUE(loop_.RunUntil([&] { return !problem.empty(); }, 10));
  EXPECT_EQ(problem, "it goes on after an exception of fact a/2: no such photo");
}

TEST_F(LedgerTest, ABrokenStateAtAFactLeavesRun) {
  LedgerFollower follower(node_, 1, [](const Fact&) { throw BrokenState("half a fact"); });
  ingest_.Commit(TestFact("a/1"));
  EXPECT_THROW(loop_.RunUntil([] { return false; }, 10), BrokenState);
}

TEST_F(LedgerTest, AFactThatCannotBeSentIsRefusedAtOnceAndNotRepeated) {
  EXPECT_THROW(node_.submitter().Submit(TestFact(std::string(kMaxMessageBytes, 'a')), nullptr),
               std::length_error);
  EXPECT_EQ(node_.submitter().pending(), 0);
}

TEST_F(LedgerTest, LateJoinerReplaysMoreThanOneRange) {
  const int count = 2 * kMaxRangeFacts + 7;
  for (int i = 0; i < count; ++i) ingest_.Commit(TestFact("a/" + std::to_string(i)));
  Delivered delivered;
  LedgerFollower follower(node_, 1, std::ref(delivered));
  ASSERT_TRUE(loop_.RunUntil([&] { return follower.processed_seq() == count; }, 20));
  delivered.ExpectAllFrom(1, count);
}

TEST_F(LedgerTest, ManyWhoAskForTheLedgerShareItsBlobs) {
  const int count = kMaxRangeFacts + kMaxRangeFacts / 2;
  for (int i = 0; i < count; ++i) ingest_.Commit(TestFact("a/" + std::to_string(i)));
  std::set<std::string> blobs;
  int num_answers = 0;
  bus_.Subscribe(kLedgerRangeChannel, [&](const ledger_range_t& range) {
    const int64_t asked = std::stoll(range.requester);
    EXPECT_TRUE(range.from_seq <= asked && asked <= range.to_seq) << asked;
    blobs.insert(range.blob_id);
    ++num_answers;
  });
  for (int64_t from = 1; from <= 400; ++from) {
    ledger_request_t request{};
    request.requester = std::to_string(from);
    request.from_seq = from;
    request.to_seq = from + kMaxRangeFacts - 1;
    node_.Publish(kLedgerRequestChannel, request);
  }
  ASSERT_TRUE(loop_.RunUntil([&] { return num_answers == 400; }, 20));
  EXPECT_EQ(blobs.size(), 1u);
}

TEST_F(LedgerTest, FollowerStartsWhereACheckpointEnded) {
  for (int i = 0; i < 20; ++i) ingest_.Commit(TestFact("a/" + std::to_string(i)));
  Delivered delivered;
  LedgerFollower follower(node_, 15, std::ref(delivered));
  ASSERT_TRUE(loop_.RunUntil([&] { return follower.processed_seq() == 20; }, 10));
  delivered.ExpectAllFrom(15, 6);
}

TEST_F(LedgerTest, FollowerRepairsGapsUnderLoss) {
  bus_.SetDropReceived(DropShare(0.2, 7));
  Delivered delivered;
  LedgerFollower follower(node_, 1, std::ref(delivered));
  int committed = 0;
  const auto timer = loop_.AddTimer(0.002, [&] {
    if (committed < 300) ingest_.Commit(TestFact("a/" + std::to_string(committed++)));
  });
  EXPECT_TRUE(loop_.RunUntil([&] { return follower.processed_seq() == 300; }, 30));
  loop_.CancelTimer(timer);
  delivered.ExpectAllFrom(1, 300);
}

TEST_F(LedgerTest, HeadTellsOfALostLastFact) {
  Delivered delivered;
  LedgerFollower follower(node_, 1, std::ref(delivered));
  bus_.SetDropReceived([](const std::string& channel) { return channel == "SKEIN_REGISTRATION"; });
  ingest_.Commit(TestFact("only"));
  ASSERT_TRUE(loop_.RunUntil([&] { return follower.processed_seq() == 1; }, 10));
  delivered.ExpectAllFrom(1, 1);
}

TEST_F(LedgerTest, FollowerOrdersWhatComesReordered) {
  Delivered delivered;
  LedgerFollower follower(node_, 1, std::ref(delivered));
  for (const int64_t seq : {3, 1, 2, 2, 5, 4}) {
    registration_t fact = TestFact("r/" + std::to_string(seq));
    fact.header.session_id = node_.session_id();
    fact.header.seq = seq;
    bus_.Publish(kRegistrationChannel, fact);
  }
  ASSERT_TRUE(loop_.RunUntil([&] { return follower.processed_seq() == 5; }, 10));
  delivered.ExpectAllFrom(1, 5);
}

TEST_F(LedgerTest, SubmitterRepeatsUntilCommittedUnderLoss) {
  bus_.SetDropReceived(DropShare(0.4, 11));
  int committed = 0;
  for (int i = 0; i < 20; ++i) {
    node_.submitter().Submit(TestFact("s/" + std::to_string(i)), [&](const Submission& done) {
      EXPECT_TRUE(done.committed());
      EXPECT_GT(done.seq, 0);
      ++committed;
    });
  }
  ASSERT_TRUE(loop_.RunUntil([&] { return node_.submitter().pending() == 0; }, 30));
  EXPECT_EQ(committed, 20);
  EXPECT_EQ(ingest_.facts().size(), 20u);
  EXPECT_GT(ingest_.num_submissions(), 20);
  EXPECT_EQ(Header(ingest_.facts()[0]).author, "worker");
}

TEST_F(LedgerTest, SubmitterTellsARefusalWithItsReason) {
  ingest_.Refuse([](const Fact& fact) {
    const bool stale = Header(fact).fact_id == "stale";
    return stale ? RefusedFact{submit_reply_t::NOT_LEASED, "older epoch"}
                 : RefusedFact{submit_reply_t::REFUSED, "no such photo"};
  });
  std::map<std::string, Submission> told;
  for (const std::string id : {"stale", "other"}) {
    node_.submitter().Submit(TestFact(id), [&, id](const Submission& done) { told[id] = done; });
  }
  ASSERT_TRUE(loop_.RunUntil([&] { return told.size() == 2; }, 10));
  EXPECT_EQ(told["stale"].state, Submission::State::kNotLeased);
  EXPECT_EQ(told["stale"].reason, "older epoch");
  EXPECT_EQ(told["other"].state, Submission::State::kRefused);
  EXPECT_EQ(told["other"].reason, "no such photo");
}

TEST_F(LedgerTest, SubmissionIsConfirmedByTheLedgerWhenRepliesAreLost) {
  bus_.SetDropReceived([](const std::string& channel) { return channel == "SKEIN_SUBMIT_REPLY"; });
  LedgerFollower follower(node_, 1, [](const Fact&) {});
  int64_t committed_seq = 0;
  node_.submitter().Submit(TestFact("s/1"),
                           [&](const Submission& done) { committed_seq = done.seq; });
  ASSERT_TRUE(loop_.RunUntil([&] { return committed_seq == 1; }, 10));
}

TEST_F(LedgerTest, SameFactSubmittedTwiceIsCommittedOnce) {
  int answers = 0;
  const auto count = [&](const Submission& done) {
    EXPECT_TRUE(done.committed());
    EXPECT_EQ(done.seq, 1);
    ++answers;
  };
  node_.submitter().Submit(TestFact("same"), count);
  node_.submitter().Submit(TestFact("same"), count);
  ASSERT_TRUE(loop_.RunUntil([&] { return answers == 2; }, 10));
  node_.submitter().Submit(TestFact("same"), count);
  ASSERT_TRUE(loop_.RunUntil([&] { return answers == 3; }, 10));
  EXPECT_EQ(ingest_.facts().size(), 1u);
}

TEST_F(LedgerTest, SubmitWithoutFactIdThrows) {
  EXPECT_THROW(node_.submitter().Submit(TestFact(""), {}), std::invalid_argument);
}

TEST(LedgerRange, ReadsBackAndRefusesDamage) {
  LedgerRangeWriter writer;
  for (int64_t seq = 5; seq < 8; ++seq) {
    registration_t fact = TestFact("r/" + std::to_string(seq));
    fact.header.seq = seq;
    const Bytes payload = EncodeFact(fact);
    ASSERT_TRUE(writer.Add(FactKind(Fact(fact)), payload.data(), payload.size()));
  }
  const Bytes bytes = writer.Take();
  const auto facts = DecodeLedgerRange(bytes);
  ASSERT_TRUE(facts.ok()) << facts.error();
  ASSERT_EQ(facts->size(), 3u);
  EXPECT_EQ(std::get<registration_t>(facts->back()).reason, "reason of r/7");

  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(DecodeLedgerRange(Bytes(bytes.begin(), bytes.begin() + size)).ok()) << size;
  }
  Bytes longer = bytes;
  longer.push_back(0);
  EXPECT_FALSE(DecodeLedgerRange(longer).ok());
  Bytes other_version = bytes;
  other_version[4] = 9;
  EXPECT_FALSE(DecodeLedgerRange(other_version).ok());
}

TEST(LedgerRange, IsBoundedInFactsAndBytes) {
  LedgerRangeWriter writer;
  const Bytes large(kMaxRangeBytes, 0);
  EXPECT_TRUE(writer.Add(0, large.data(), large.size()));  // the first always fits
  EXPECT_FALSE(writer.Add(0, large.data(), 1));
  writer.Take();
  for (int i = 0; i < kMaxRangeFacts; ++i) ASSERT_TRUE(writer.Add(0, large.data(), 1));
  EXPECT_FALSE(writer.Add(0, large.data(), 1));
}

}  // namespace skein::ledger_test
