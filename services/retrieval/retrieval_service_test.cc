#include "retrieval/retrieval_service.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <new>
#include <optional>
#include <random>

#include "core/file.h"
#include "ledger/session_folder.h"
#include "testing/test_folder.h"
#include "testing/test_node.h"

namespace skein::retrieval_service_test {

constexpr double kDeadlineS = 60;
constexpr int kDim = 16;

NodeOptions IngestOptions(const std::string& session_id) {
  NodeOptions options = TestOptions("ingest");
  options.session_id = session_id;
  return options;
}

// An ingest with photos, and what retrieval asks it for and answers.
class Ingest {
 public:
  Ingest(const std::string& session_id, PollLoop& loop, Bus& bus)
      : node_(IngestOptions(session_id), loop, bus) {
    bus.Subscribe(kLedgerRequestChannel, [this](const ledger_request_t& request) {
      lowest_asked_ = std::min(lowest_asked_, request.from_seq);
    });
    bus.Subscribe<candidates_t>(kSubmitCandidatesChannel, [this](const candidates_t& candidates) {
      candidates_.emplace(candidates.image_id, candidates);
    });
  }

  void AddPhoto(int64_t image_id) {
    features_t features{};
    features.image_id = image_id;
    features.global_model = "m";
    features.global_blob = node_.blobs().Offer(EncodeGlobalDescriptor({"m", Vector(image_id)}));
    Commit(features, "features/" + std::to_string(image_id));
  }

  // With whatever the blob holds.
  void AddPhotoOf(int64_t image_id, const Bytes& global_blob) {
    features_t features{};
    features.image_id = image_id;
    features.global_model = "m";
    features.global_blob = node_.blobs().Offer(global_blob);
    Commit(features, "features/" + std::to_string(image_id));
  }

  void AddFailure(int64_t image_id, bool parked) {
    failure_t failure{};
    failure.image_id = image_id;
    failure.stage = "matching";
    failure.parked = parked;
    Commit(failure, "failure/" + std::to_string(image_id));
  }

  // Unit vectors that depend on the id only.
  static std::vector<float> Vector(int64_t image_id) {
    std::mt19937 random(static_cast<uint32_t>(image_id));
    std::normal_distribution<float> normal;
    std::vector<float> v(kDim);
    float sum = 0;
    for (float& x : v) {
      x = normal(random);
      sum += x * x;
    }
    for (float& x : v) x /= std::sqrt(sum);
    return v;
  }

  const std::map<int64_t, candidates_t>& candidates() const { return candidates_; }
  // The first ledger position asked for since ForgetAsked.
  int64_t lowest_asked() const { return lowest_asked_; }
  void ForgetAsked() { lowest_asked_ = 1 << 30; }

 private:
  template <class T>
  void Commit(T fact, const std::string& fact_id) {
    fact.header.fact_id = fact_id;
    memory_.Commit(Fact(fact));
  }

  Node node_;
  MemoryIngest memory_{node_};
  std::map<int64_t, candidates_t> candidates_;
  int64_t lowest_asked_ = 1 << 30;
};

class Retrieval : public testing::Test {
 protected:
  Retrieval() : session_(*OpenOrCreateSession(folder_.path() / "s")) {
    ingest_.emplace(session_.session_id, loop_, bus_);
    for (int64_t id = 1; id <= 20; ++id) ingest_->AddPhoto(id);
  }

  void Start() {
    ingest_->ForgetAsked();
    NodeOptions options;
    options.service = "retrieval";
    options.session_dir = session_.paths.root.string();
    node_.emplace(options, loop_, bus_);
    service_.emplace(*node_, RetrievalOptions());
  }

  // As on SIGTERM: the last checkpoint is written.
  void Stop() {
    service_.reset();
    node_.reset();
  }

  bool RunUntilAnswered(size_t num_photos) {
    return loop_.RunUntil([&] { return ingest_->candidates().size() == num_photos; }, kDeadlineS);
  }

  // One session with a checkpoint of 20 photos.
  void RunOnce() {
    Start();
    ASSERT_TRUE(RunUntilAnswered(20));
    Stop();
    ASSERT_TRUE(std::filesystem::exists(Path()));
  }

  // A restart with whatever lies there; the next photo's candidates must be the right ones.
  void RestartAndAddPhoto() {
    Start();
    ingest_->AddPhoto(21);
    ASSERT_TRUE(RunUntilAnswered(21));
    RetrievalState fresh{RetrievalOptions{}};
    for (int64_t id = 1; id <= 20; ++id) ASSERT_TRUE(fresh.Add(id, {"m", Ingest::Vector(id)}).ok());
    std::vector<int64_t> expected;
    const auto candidates = fresh.Add(21, {"m", Ingest::Vector(21)});
    for (const auto& n : candidates->neighbours) expected.push_back(n.id);
    EXPECT_EQ(ingest_->candidates().at(21).other_ids, expected);
  }

  bool IsRebuilt() const { return ingest_->lowest_asked() == 1; }
  std::filesystem::path Path() const { return session_.paths.Retrieval() / "hnsw.bin"; }
  Bytes Checkpoint() const { return *ReadFile(Path()); }
  void Write(const Bytes& bytes) { ASSERT_TRUE(WriteFileAtomic(Path(), bytes).ok()); }

  TestFolder folder_;
  Session session_;
  PollLoop loop_;
  Bus bus_{"memq://", loop_};
  std::optional<Ingest> ingest_;
  std::optional<Node> node_;
  std::optional<RetrievalService> service_;
};

TEST_F(Retrieval, GoesOnFromItsCheckpoint) {
  RunOnce();
  RestartAndAddPhoto();
  EXPECT_FALSE(IsRebuilt());
}

TEST_F(Retrieval, FlippedByteIsNoticedAndTheIndexRebuilt) {
  RunOnce();
  Bytes bytes = Checkpoint();
  bytes[bytes.size() / 2] ^= 1;
  Write(bytes);
  RestartAndAddPhoto();
  EXPECT_TRUE(IsRebuilt());
}

TEST_F(Retrieval, VersionFromTheFutureIsNotReadAndTheIndexRebuilt) {
  RunOnce();
  Bytes bytes = Checkpoint();
  bytes[4] = 99;
  Write(bytes);
  RestartAndAddPhoto();
  EXPECT_TRUE(IsRebuilt());
}

TEST_F(Retrieval, StaleCheckpointIsBroughtUpToDateFromTheLedger) {
  RetrievalState stale{RetrievalOptions{}};
  for (int64_t id = 1; id <= 5; ++id) ASSERT_TRUE(stale.Add(id, {"m", Ingest::Vector(id)}).ok());
  stale.set_seq(5);
  RunOnce();
  Write(stale.Encode(session_.session_id));
  RestartAndAddPhoto();
  EXPECT_EQ(ingest_->lowest_asked(), 6);
}

TEST_F(Retrieval, CheckpointAheadOfTheLedgerIsRebuilt) {
  RetrievalState ahead{RetrievalOptions{}};
  ahead.set_seq(1000);
  RunOnce();
  Write(ahead.Encode(session_.session_id));
  RestartAndAddPhoto();
  EXPECT_TRUE(IsRebuilt());
}

TEST_F(Retrieval, WhatAKilledWriterLeftIsClearedAway) {
  RunOnce();
  const std::filesystem::path leftover = Path().string() + ".tmp-123-0";
  std::ofstream(leftover) << "half a checkpoint";
  RestartAndAddPhoto();
  EXPECT_FALSE(std::filesystem::exists(leftover));
  EXPECT_FALSE(IsRebuilt());
}

// Each is answered for, without candidates; those after it get theirs, also after a restart.
TEST_F(Retrieval, DescriptorsThatCannotBeUsedHoldUpNobody) {
  const std::vector<Bytes> poisoned = {
      {},
      {1, 2, 3},
      EncodeGlobalDescriptor({"m", {}}),
      EncodeGlobalDescriptor({"m", {1}}),
      EncodeGlobalDescriptor({"", std::vector<float>(kDim, 0)}),
      EncodeGlobalDescriptor({"m", std::vector<float>(kDim, NAN)}),
      EncodeGlobalDescriptor({"m", std::vector<float>(kDim, HUGE_VALF)}),
      EncodeGlobalDescriptor({"m", std::vector<float>(kDim + 1, 1)}),
  };
  Start();
  int64_t id = 100;
  for (const Bytes& blob : poisoned) ingest_->AddPhotoOf(id++, blob);
  for (const bool restart : {false, true}) {
    if (restart) {
      Stop();
      std::filesystem::remove(Path());
      Start();
    }
    ingest_->AddPhoto(++id);
    ASSERT_TRUE(RunUntilAnswered(20 + poisoned.size() + (restart ? 2 : 1)));
    EXPECT_GE(ingest_->candidates().at(id).other_ids.size(), 20u);
  }
  for (size_t i = 0; i < poisoned.size(); ++i) {
    EXPECT_TRUE(ingest_->candidates().at(100 + static_cast<int64_t>(i)).other_ids.empty()) << i;
  }
}

TEST_F(Retrieval, APhotoOnWhichAnExceptionComesHasNoCandidates) {
  RunOnce();
  ingest_->AddPhoto(21);
  ingest_->AddPhoto(22);
  Start();
  node_->steps().OnBegin([](const Step& step) {
    if (step.item == 21) throw std::bad_alloc();
  });
  ASSERT_TRUE(RunUntilAnswered(22));
  EXPECT_TRUE(ingest_->candidates().at(21).other_ids.empty());
  EXPECT_EQ(ingest_->candidates().at(22).other_ids.size(), 20u);
}

TEST_F(Retrieval, APhotoOnWhichProcessesDiedThriceHasNoCandidates) {
  RunOnce();
  FailedItems failed(session_.paths.root, "retrieval.failed", "candidates", {}, 0);
  for (int i = 0; i < kMaxFailures; ++i) failed.Note(21);
  ingest_->AddPhoto(21);
  ingest_->AddPhoto(22);
  Start();
  ASSERT_TRUE(RunUntilAnswered(22));
  EXPECT_TRUE(ingest_->candidates().at(21).other_ids.empty());
  EXPECT_EQ(ingest_->candidates().at(22).other_ids.size(), 20u);
}

TEST_F(Retrieval, PhotoThatWasGivenUpIsNoCandidate) {
  RunOnce();
  ingest_->AddFailure(3, true);
  ingest_->AddFailure(4, false);
  Start();
  ingest_->AddPhoto(21);
  ASSERT_TRUE(RunUntilAnswered(21));
  const auto& others = ingest_->candidates().at(21).other_ids;
  EXPECT_EQ(std::count(others.begin(), others.end(), 3), 0);
  EXPECT_EQ(std::count(others.begin(), others.end(), 4), 1);
}

}  // namespace skein::retrieval_service_test
