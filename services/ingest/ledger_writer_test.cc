// Facts go through the ledger's writer. From them follow the session's state, the report, the rules
// of submission and the open work.
#include "ingest/ledger_writer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "core/attempt.h"
#include "ingest/submission_rules.h"
#include "ingest/work_planner.h"
#include "ledger/fact_ids.h"
#include "session/report.h"
#include "session/session_history.h"
#include "session/submap_facts.h"
#include "testing/test_folder.h"

namespace skein::ledger_writer_test {

// Commits facts on a clock that advances a second a fact.
class LedgerWriterTest : public testing::Test {
 protected:
  LedgerWriterTest() { Reopen(); }

  void Reopen() {
    writer_.reset();
    writer_ = std::make_unique<LedgerWriter>(*Ledger::Open(folder_ / "ledger.db"), "session",
                                             [this] { return now_us_ += 1000000; });
  }
  const SessionState& state() const { return writer_->state(); }
  const SessionRecord& session() const { return writer_->session(); }

  template <class T>
  T Commit(T fact, const std::string& fact_id, const std::string& author = "ingest") {
    fact.header.fact_id = fact_id;
    fact.header.author = author;
    const Fact staged = writer_->Stage(fact);
    writer_->Flush();
    return std::get<T>(staged);
  }
  void AddPhoto() {
    image_t image{};
    image.agent = "alice";
    image.name = std::to_string(state().num_images() + 1) + ".jpg";
    image.blob_id = "blob" + image.name;
    image.camera_id = 1;
    image.received_utime_us = now_us_;
    Commit(image, "image/" + image.name);
  }
  template <class T>
  void AddForPhoto(T fact, const std::string& kind, int64_t image_id) {
    fact.image_id = image_id;
    Commit(fact, kind + "/" + std::to_string(image_id));
  }
  void AddMatchedPhoto(int num_keypoints = 100) {
    AddPhoto();
    features_t features{};
    features.num_keypoints = num_keypoints;
    AddForPhoto(features, "features", state().num_images());
    AddForPhoto(candidates_t{}, "candidates", state().num_images());
    AddForPhoto(matches_t{}, "matches", state().num_images());
  }
  int64_t AddSubmap(const std::string& owner) {
    seed_t seed{};
    seed.image_id1 = 1;
    seed.image_id2 = 2;
    const int64_t id = Commit(seed, "seed/" + std::to_string(state().head())).submap_id;
    submap_lease_t lease{};
    lease.submap_id = id;
    lease.epoch = 1;
    lease.owner = owner;
    Commit(lease, SubmapLeaseFactId(id, 1));
    return id;
  }
  void Register(int64_t image_id, int64_t submap_id, int8_t state = registration_t::REGISTERED) {
    registration_t fact{};
    fact.image_id = image_id;
    fact.submap_id = submap_id;
    fact.epoch = 1;
    fact.state = state;
    fact.reason = "too few inliers";
    Commit(fact, "registration/" + std::to_string(this->state().head()));
  }
  void End(int64_t submap_id) {
    Commit(MakeSubmapEnd(submap_id, 1, "initial pair"), SubmapEndFactId(submap_id));
  }

  TestFolder folder_;
  int64_t now_us_ = 0;
  std::unique_ptr<LedgerWriter> writer_;
};

TEST_F(LedgerWriterTest, CountsCandidatesThatVerifyApartFromOtherPairs) {
  for (int i = 0; i < 3; ++i) AddPhoto();
  candidates_t candidates{};
  candidates.other_ids = {1, 2};
  candidates.distances = {0.5f, 0.6f};
  candidates.num_candidates = 2;
  AddForPhoto(candidates, "candidates", 3);
  EXPECT_EQ(session().history.retrieval().candidates, 0) << "not matched yet";
  matches_t matches{};
  matches.num_tried = 3;
  matches.num_pairs = 2;
  matches.pairs.resize(2);
  matches.pairs[0].other_id = 2;
  matches.pairs[1].other_id = 77;  // through covisibility
  AddForPhoto(matches, "matches", 3);
  EXPECT_EQ(session().history.retrieval().candidates, 2);
  EXPECT_EQ(session().history.retrieval().hits, 1);
  EXPECT_EQ(session().history.retrieval().pairs_matched, 3);
  EXPECT_EQ(session().history.retrieval().pairs_verified, 2);
}

TEST_F(LedgerWriterTest, IsTheSameAfterReplay) {
  AddMatchedPhoto();
  AddMatchedPhoto();
  AddMatchedPhoto(0);
  AddPhoto();
  Register(1, AddSubmap("mapper-1"));
  failure_t failure{};
  failure.stage = "features";
  failure.image_id = 4;
  failure.parked = true;
  failure.reason = "cannot decode";
  Commit(failure, "failure/features/4/1");
  const std::string before = MakeReport(session(), 3, 1).dump();
  const int64_t in_flight = state().num_in_flight();
  Reopen();
  EXPECT_EQ(MakeReport(session(), 3, 1).dump(), before);
  EXPECT_EQ(state().num_in_flight(), in_flight);
}

TEST_F(LedgerWriterTest, AccountsForEveryPhoto) {
  AddMatchedPhoto();
  AddMatchedPhoto();
  AddMatchedPhoto(0);
  Register(1, AddSubmap("mapper-1"));
  Register(2, 1, registration_t::DEFERRED);
  failure_t refused{};
  refused.stage = "ingest";
  refused.parked = true;
  Commit(refused, RefusedOfferFactId("alice", "x.jpg", "y"));
  const PhotoCounts counts = CountPhotos(session(), 0);
  EXPECT_EQ(counts.received, 4);
  EXPECT_EQ(counts.registered, 1);
  EXPECT_EQ(counts.deferred, 2);
  EXPECT_EQ(counts.failed, 1);
}

TEST_F(LedgerWriterTest, CountsAPhotoOnlyWhileASubmapThatHoldsItLives) {
  AddMatchedPhoto();
  AddMatchedPhoto();
  const int64_t submap = AddSubmap("mapper-1");
  Register(1, submap);
  EXPECT_TRUE(state().IsRegistered(1));
  Register(1, submap, registration_t::WITHDRAWN);
  EXPECT_FALSE(state().IsRegistered(1));
  Register(1, submap);
  End(submap);
  EXPECT_FALSE(state().IsRegistered(1));
}

TEST_F(LedgerWriterTest, TakesLatencyFromTheFirstRegistration) {
  AddMatchedPhoto();
  AddMatchedPhoto();
  const int64_t submap = AddSubmap("mapper-1");
  Register(1, submap);
  const auto latency = PhotoToPoseSeconds(session());
  Register(1, submap, registration_t::WITHDRAWN);
  Register(1, submap);
  EXPECT_EQ(PhotoToPoseSeconds(session()), latency);
  ASSERT_EQ(latency.size(), 1u);
  EXPECT_GT(latency[0], 0);
}

TEST_F(LedgerWriterTest, TellsWhereTheTimeToThePoseWent) {
  AddMatchedPhoto();
  AddMatchedPhoto();
  const int64_t submap = AddSubmap("mapper-1");
  Register(1, submap);
  const auto latency = LatencyPart(session());
  ASSERT_EQ(latency["stages"].size(), 5u);
  double sum = 0;
  for (const auto& stage : latency["stages"]) {
    EXPECT_GE(stage["p50"], 0.0);
    sum += stage["p50"].get<double>();
  }
  EXPECT_NEAR(sum, PhotoToPoseSeconds(session())[0], 1e-6) << "of the one photo that is placed";
  EXPECT_EQ(latency["stages"][0]["stage"], "ingest");
  EXPECT_TRUE(latency["stages"][0]["work_p50"].is_null());
  EXPECT_EQ(latency["stages"][4]["stage"], "mapper");
  Register(1, submap, registration_t::WITHDRAWN);
  Register(1, submap);
  EXPECT_EQ(LatencyPart(session()), latency) << "the first one counts";
}

TEST_F(LedgerWriterTest, ForgetsAVanishedAgentWhosePhotoCame) {
  failure_t vanished{};
  vanished.stage = "ingest";
  Commit(vanished, VanishedAgentFactId("blob1.jpg", 1));
  EXPECT_EQ(session().history.Failures().size(), 1u);
  AddPhoto();
  EXPECT_TRUE(session().history.Failures().empty());
}

TEST_F(LedgerWriterTest, GivesIdsAtCommit) {
  AddMatchedPhoto();
  AddMatchedPhoto();
  EXPECT_EQ(AddSubmap("mapper-1"), 1);
  End(1);
  EXPECT_EQ(AddSubmap("mapper-1"), 2);
  merge_t merge{};
  merge.state = merge_t::ORDERED;
  merge.source_id = 1;
  merge.target_id = 2;
  const merge_t ordered = Commit(merge, "merge/1");
  EXPECT_EQ(ordered.merge_id, ordered.header.seq);
  EXPECT_EQ(state().FindSubmap(2)->open_merge_id, ordered.merge_id);
}

TEST_F(LedgerWriterTest, RefusesAStaleEpochAndAnotherAuthor) {
  AddMatchedPhoto();
  AddMatchedPhoto();
  registration_t fact{};
  fact.header.fact_id = "registration/x";
  fact.header.author = "mapper-1";
  fact.image_id = 1;
  fact.submap_id = AddSubmap("mapper-1");
  fact.epoch = 1;
  fact.state = registration_t::REGISTERED;
  fact.cam_from_world_qwxyz[0] = 1;
  EXPECT_EQ(CheckLease(fact, state()).error(), "");
  EXPECT_EQ(CheckSubmission(fact, state()).error(), "");
  fact.epoch = 0;
  EXPECT_FALSE(CheckLease(fact, state()).ok());
  fact.epoch = 1;
  fact.header.author = "mapper-2";
  EXPECT_FALSE(CheckLease(fact, state()).ok());
  fact.header.author = "mapper-1";
  fact.cam_from_world_xyz[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(CheckLease(fact, state()).ok());
  EXPECT_FALSE(CheckSubmission(fact, state()).ok());
}

TEST_F(LedgerWriterTest, RefusesASubmittedLease) {
  submap_lease_t lease{};
  lease.submap_id = AddSubmap("mapper-1");
  lease.epoch = 2;
  lease.owner = lease.header.author = "mapper-2";
  lease.header.fact_id = SubmapLeaseFactId(lease.submap_id, lease.epoch);
  EXPECT_EQ(CheckSubmission(lease, state()).error(), "leases are ingest's to give");
}

TEST_F(LedgerWriterTest, AMapperMayEndItsSubmapButNotMergeIt) {
  submap_end_t end = MakeSubmapEnd(AddSubmap("mapper-1"), 1, "initial pair");
  end.header.author = "mapper-1";
  EXPECT_EQ(CheckLease(end, state()).error(), "");
  EXPECT_EQ(CheckSubmission(end, state()).error(), "");
  end.header.author = "mapper-2";
  EXPECT_FALSE(CheckLease(end, state()).ok());
  end.header.author = "mapper-1";
  end.merged_into = 7;
  EXPECT_FALSE(CheckSubmission(end, state()).ok());
  end.merged_into = 0;
  end.header.fact_id = "submap/another/end";
  EXPECT_FALSE(CheckSubmission(end, state()).ok());
}

TEST_F(LedgerWriterTest, RefusesAModelOfNoKindOrWithoutItsBlob) {
  submap_model_t model{};
  model.submap_id = AddSubmap("mapper-1");
  model.epoch = 1;
  model.header.author = "mapper-1";
  model.header.fact_id = SubmapModelFactId(model.submap_id, 1, 1);
  model.kind = submap_model_t::CHECKPOINT;
  EXPECT_EQ(CheckSubmission(model, state()).error(), "no model");
  model.model_blob = std::string(64, 'a');
  EXPECT_EQ(CheckSubmission(model, state()).error(), "");
  model.kind = 3;
  EXPECT_FALSE(CheckSubmission(model, state()).ok());
  model.kind = submap_model_t::FINAL;
  model.ledger_seq = state().head() + 1;
  EXPECT_FALSE(CheckSubmission(model, state()).ok());
}

TEST_F(LedgerWriterTest, RefusesAModelWhosePositionOnTheEarthIsNoSimilarity) {
  submap_model_t model{};
  model.submap_id = AddSubmap("mapper-1");
  model.header.author = "mapper-1";
  model.header.fact_id = SubmapModelFactId(model.submap_id, 1, 1);
  model.kind = submap_model_t::FINAL;
  model.model_blob = std::string(64, 'a');
  georeference_t& earth = model.georeference;
  earth.ok = 1;
  EXPECT_FALSE(CheckSubmission(model, state()).ok()) << "its scale is 0";
  earth.scale = 2;
  EXPECT_FALSE(CheckSubmission(model, state()).ok()) << "its rotation is none";
  earth.rotation_qwxyz[0] = 1;
  EXPECT_EQ(CheckSubmission(model, state()).error(), "");
  earth.translation_m[2] = NAN;
  EXPECT_FALSE(CheckSubmission(model, state()).ok());
}

TEST_F(LedgerWriterTest, RefusesAPairWithoutInliers) {
  AddPhoto();
  AddPhoto();
  AddForPhoto(features_t{}, "features", 2);
  AddForPhoto(candidates_t{}, "candidates", 2);
  matches_t matches{};
  matches.header.fact_id = MatchesFactId(2);
  matches.header.author = "matching";
  matches.image_id = 2;
  matches.pairs.resize(1);
  matches.num_pairs = 1;
  matches.pairs[0].other_id = 1;
  matches.pairs[0].num_inliers = 0;
  matches.pairs_blob = std::string(64, 'a');
  EXPECT_FALSE(CheckSubmission(matches, state()).ok());
  matches.pairs[0].num_inliers = 15;
  EXPECT_EQ(CheckSubmission(matches, state()).error(), "");
}

TEST_F(LedgerWriterTest, AStepOfAMergeNeedsTheLeaseOfItsSide) {
  merge_t step{};
  step.header.author = "mapper-1";
  step.source_id = AddSubmap("mapper-1");
  step.target_id = AddSubmap("mapper-2");
  step.source_epoch = step.target_epoch = 1;
  step.state = merge_t::FROZEN;
  EXPECT_TRUE(CheckLease(step, state()).ok());
  for (const int8_t state_of_target : {merge_t::DONE, merge_t::UNDONE}) {
    step.state = state_of_target;
    EXPECT_FALSE(CheckLease(step, state()).ok());
  }
  step.header.author = "mapper-2";
  EXPECT_TRUE(CheckLease(step, state()).ok());
  step.target_epoch = 2;
  EXPECT_FALSE(CheckLease(step, state()).ok());
  step.state = merge_t::ORDERED;
  EXPECT_TRUE(CheckLease(step, state()).ok()) << "an order is the merger's";
}

TEST_F(LedgerWriterTest, ReportsAMergeThatWasUndoneWithItsReason) {
  merge_t merge{};
  merge.source_id = AddSubmap("mapper-1");
  merge.target_id = AddSubmap("mapper-2");
  merge.state = merge_t::ORDERED;
  merge.num_shared_images = 3;
  merge = Commit(merge, "merge/1");
  merge.state = merge_t::UNDONE;
  merge.reason = "visually similar places";
  Commit(merge, "merge/1/end");
  Reopen();
  const auto merges = MakeReport(session(), 0, 1)["merges"];
  ASSERT_EQ(merges.size(), 1u);
  EXPECT_EQ(merges[0]["state"], "undone");
  EXPECT_EQ(merges[0]["reason"], "visually similar places");
  EXPECT_EQ(merges[0]["shared_images"], 3);
  for (const int64_t submap_id : {1, 2}) {
    EXPECT_EQ(state().FindSubmap(submap_id)->open_merge_id, 0);
    EXPECT_FALSE(state().FindSubmap(submap_id)->ended);
  }
}

TEST_F(LedgerWriterTest, ReportsWhatEachServiceRanWith) {
  for (const auto& [instance, text] : std::vector<std::pair<std::string, std::string>>{
           {"mapper-1", "[mapper]\n"}, {"mapper-2", "[mapper]\n"}, {"mapper-1", "other"}}) {
    configuration_t fact{};
    fact.service = "mapper";
    fact.instance = instance;
    fact.text = text;
    fact.version = "0.1.0";
    Commit(fact, "configuration/" + instance + "/" + text);
  }
  const auto mappers = MakeReport(session(), 0, 0)["configuration"]["mapper"];
  ASSERT_EQ(mappers.size(), 2u);
  EXPECT_EQ(mappers[0]["instances"], (std::vector<std::string>{"mapper-1", "mapper-2"}));
  EXPECT_EQ(mappers[0]["text"], "[mapper]\n");
  EXPECT_EQ(mappers[1]["instances"], (std::vector<std::string>{"mapper-1"}));
}

TEST_F(LedgerWriterTest, FactsOutOfOrderAreABrokenContract) {
  SessionState fresh;
  image_t image{};
  image.header.seq = 2;
  EXPECT_THROW(fresh.Apply(image), std::logic_error);
  AddPhoto();
  image.header.fact_id = "image/1.jpg";
  EXPECT_THROW(writer_->Stage(image), std::logic_error);
}

TEST_F(LedgerWriterTest, DerivesTheOpenWorkFromTheLedger) {
  AddMatchedPhoto();
  AddPhoto();
  AddPhoto();
  features_t features{};
  AddForPhoto(features, "features", 2);
  AddForPhoto(candidates_t{}, "candidates", 2);
  failure_t failure{};
  failure.stage = "features";
  failure.image_id = 3;
  failure.attempts = 2;
  Commit(failure, "failure/features/3/2");
  Reopen();
  WorkPlanner planner(session(), kLeaseS, 0);
  planner.OnRequest("features", {"f", 5, 0, {}}, 0);
  planner.OnRequest("matching", {"m", 5, 0, {}}, 0);
  const auto grants = planner.Assign(0);
  ASSERT_EQ(grants.size(), 2u);
  EXPECT_EQ(grants[0].item, 3);
  EXPECT_EQ(grants[0].attempt, 3);
  EXPECT_EQ(grants[1].kind, "matching");
  EXPECT_EQ(grants[1].item, 2);
}

TEST_F(LedgerWriterTest, AFactThatIsHalfStagedIsABrokenState) {
  image_t image{};
  image.header.fact_id = "image/1";
  writer_->OnStaged([] { throw std::runtime_error("no loop"); });
  EXPECT_THROW(writer_->Stage(image), BrokenState);
  Reopen();
  EXPECT_EQ(state().num_images(), 0);
}

TEST_F(LedgerWriterTest, AnObserverThatThrowsIsABrokenStateAndTheFactIsInTheLedger) {
  writer_->AddObserver([](const Fact&) { throw std::runtime_error("no planner"); });
  image_t image{};
  image.header.fact_id = "image/1";
  writer_->Stage(image);
  EXPECT_THROW(writer_->Flush(), BrokenState);
  Reopen();
  EXPECT_EQ(state().num_images(), 1);
}

}  // namespace skein::ledger_writer_test
