#include "ingest/submission_desk.h"

#include <gtest/gtest.h>

#include <csignal>

#include "core/hash.h"
#include "ingest/submission_rules.h"
#include "ledger/fact_ids.h"
#include "node/work_client.h"
#include "testing/test_ingest.h"
#include "testing/test_photos.h"

namespace skein::submission_desk_test {

using SubmissionDeskTest = IngestServiceTest;

TEST_F(SubmissionDeskTest, TakesTheConfigurationsOfOthersOnce) {
  NodeOptions options = RemoteNode("mapper-1", ingest_->session_id());
  options.service = "mapper";
  options.configuration = "[mapper]\n";
  const configuration_t fact = ConfigurationOf(options);
  EXPECT_EQ(Submit(fact), "");
  EXPECT_EQ(Submit(fact), "");
  Await([&] { return !facts_.empty(); }, "the fact");
  EXPECT_EQ(std::get<configuration_t>(facts_[0]).instance, "mapper-1");
  EXPECT_EQ(facts_.size(), 1u);
}

TEST_F(SubmissionDeskTest, CommitsOneOfTwoResultsAndAcknowledgesBoth) {
  Publish("a.jpg", SmallJpeg());
  EXPECT_EQ(Submit(Features(1)), "");
  EXPECT_EQ(Submit(Features(1)), "");
  Await([&] { return facts_.size() == 2; }, "the features");
  EXPECT_TRUE(BlobStore(Paths().Blobs()).Has(std::get<features_t>(facts_[1]).keypoints_blob));
}

TEST_F(SubmissionDeskTest, RefusesFactsThatFitNothing) {
  EXPECT_EQ(Submit(Features(7)), "no such photo");
  EXPECT_EQ(answer_state_, Submission::State::kRefused);
  Publish("a.jpg", SmallJpeg());
  EXPECT_EQ(Submit(Matches(1)), "photo has no candidates yet");
  features_t misnamed = Features(1);
  misnamed.header.fact_id = "features/2";
  EXPECT_EQ(Submit(misnamed), "fact_id must be features/1");
  image_t image{};
  image.header.fact_id = "image/x";
  EXPECT_NE(Submit(image), "");
  failure_t failure{};
  failure.header.fact_id = "failure/features/1/1";
  failure.image_id = 1;
  failure.stage = "features";
  failure.reason = "no UTF-8: \xFF";
  EXPECT_EQ(Submit(failure), "a text is not valid UTF-8");
  submap_lease_t lease{};
  lease.header.fact_id = SubmapLeaseFactId(1, 1);
  EXPECT_EQ(Submit(lease), "leases are ingest's to give");
}

TEST_F(SubmissionDeskTest, OnlyAFrozenSourceNamesAModel) {
  merge_t failed{};
  failed.header.fact_id = "merge/failed/1";
  failed.state = merge_t::FAILED;
  failed.model_blob = HashBytes("a model", 7);
  EXPECT_EQ(Submit(failed), "only the frozen source has a model");
  failed.model_blob.clear();
  EXPECT_EQ(Submit(failed), "");
}

TEST_F(SubmissionDeskTest, PullsNoMoreThanTheFactsOwnFiguresAllow) {
  Publish("a.jpg", SmallJpeg());
  features_t features = Features(1);
  features.keypoints_blob = peer_->blobs().Offer(EncodeKeypoints(Keypoints(10000)));
  bool answered = false;
  peer_->submitter().Submit(features, [&](const Submission&) { answered = true; });
  EXPECT_FALSE(loop_.RunUntil([&] { return answered; }, 2)) << "it says that there is one keypoint";
  EXPECT_FALSE(BlobStore(Paths().Blobs()).Has(features.keypoints_blob));
}

TEST_F(SubmissionDeskTest, AnAuthorThatSendsNothingDoesNotHoldUpOthers) {
  AddMatchedPhoto(1);
  AddMatchedPhoto(2);
  EXPECT_EQ(Submit(Seed(1, 2)), "");
  WorkClient mapper(*peer_, "submap", 1, [](const work_t&) {});
  Await([&] { return Find<submap_lease_t>([](const auto&) { return true; }) != nullptr; },
        "the lease");
  for (int i = 1; i <= 5; ++i) {  // the author is right, its blobs are nowhere
    submap_model_t model = FinalModel(1, 1, i);
    model.model_blob = HashBytes(&i, sizeof(i));
    peer_->submitter().Submit(model, [](const Submission&) {});
  }
  Node other(RemoteNode("other", ingest_->session_id()), loop_, bus_);
  Publish("c.jpg", SmallJpeg(3));
  features_t features = Features(3);
  features.keypoints_blob = other.blobs().Offer(EncodeKeypoints({Keypoint()}));
  features.descriptors_blob = other.blobs().Offer(EncodeDescriptors({Bytes(128, 3)}));
  features.global_blob = other.blobs().Offer(EncodeGlobalDescriptor({"vlad", {1}}));
  EXPECT_EQ(Submit(features, &other), "");
}

// A worker left with its blob, and another one's repeats of the same fact kept the pull alive: a
// session of 600 photos waited for its last one for ever.
TEST_F(SubmissionDeskTest, AnAuthorThatLeftDoesNotHoldUpAnotherOfTheSameFact) {
  Publish("a.jpg", SmallJpeg());
  {
    Node gone(RemoteNode("gone", ingest_->session_id()), loop_, bus_);
    features_t features = Features(1);
    features.keypoints_blob = HashBytes("nowhere", 7);
    bool is_pulled = false;
    const auto replies =
        bus_.Subscribe<submit_reply_t>(kSubmitReplyChannel, [&](const submit_reply_t& reply) {
          is_pulled |= reply.author == "gone" && reply.status == submit_reply_t::PULLING;
        });
    gone.submitter().Submit(features, [](const Submission&) {});
    Await([&] { return is_pulled; }, "a pull");
    bus_.Unsubscribe(replies);
  }
  EXPECT_EQ(Submit(Features(1)), "");
}

TEST(SubmissionRules, ABoundIsKnownForEachBlobThatAFactNames) {
  features_t features{};
  features.keypoints_blob = "k", features.descriptors_blob = "d", features.global_blob = "g";
  matches_t matches{};
  matches.pairs_blob = "p";
  submap_model_t model{};
  merge_t merge{};
  model.model_blob = merge.model_blob = "m";
  for (const Fact& fact :
       {Fact(features), Fact(matches), Fact(model), Fact(merge), Fact(seed_t{})}) {
    std::vector<std::string> names;
    for (const NamedBlob& blob : NamedBlobs(fact)) {
      names.push_back(blob.blob_id);
      EXPECT_GT(blob.max_bytes, 0);
    }
    EXPECT_EQ(names, BlobsOf(fact)) << FactKindName(fact);
  }
}

TEST_F(SubmissionDeskTest, HandsOutWorkAsItAppears) {
  std::vector<int64_t> given;
  WorkClient features(*peer_, "features", 2,
                      [&](const work_t& work) { given.push_back(work.item_id); });
  for (int i = 1; i <= 3; ++i) Publish(std::to_string(i) + ".jpg", SmallJpeg(i));
  Await([&] { return given.size() == 2; }, "two photos");
  EXPECT_EQ(given, (std::vector<int64_t>{1, 2}));
  EXPECT_EQ(Submit(Features(1)), "");
  features.Done(1);
  Await([&] { return given.size() == 3; }, "the third photo");
}

TEST_F(SubmissionDeskTest, ParksWhatFailsForGoodAndSaysSo) {
  WorkClient features(*peer_, "features", 1, [&](const work_t& work) {
    features.Fail(work.item_id, "no such model", true);
  });
  Publish("a.jpg", SmallJpeg());
  const auto is_parked = [](const failure_t& f) { return f.parked && f.image_id == 1; };
  Await([&] { return Find<failure_t>(is_parked) != nullptr; }, "the failure");
  EXPECT_EQ(Find<failure_t>(is_parked)->reason, "no such model (peer)");
  EXPECT_EQ(Find<failure_t>(is_parked)->name, "a.jpg");
}

TEST_F(SubmissionDeskTest, RefusesTheFactsOfAnOlderEpoch) {
  AddMatchedPhoto(1);
  AddMatchedPhoto(2);
  EXPECT_EQ(Submit(Seed(1, 2)), "");
  EXPECT_EQ(Submit(Seed(2, 1)), "photo is in a seed already");
  std::vector<int64_t> epochs;
  {
    WorkClient mapper(*peer_, "submap", 1,
                      [&](const work_t& work) { epochs.push_back(work.epoch); });
    Await([&] { return epochs.size() == 1; }, "the submap");
    EXPECT_EQ(Submit(Registration(1, 1, 1)), "");
    EXPECT_EQ(Submit(Registration(2, 1, 2)).substr(0, 15), "epoch 2 is over");
  }
  // The first mapper falls silent; another takes over.
  Node other(RemoteNode("other", ingest_->session_id()), loop_, bus_);
  WorkClient successor(other, "submap", 1,
                       [&](const work_t& work) { epochs.push_back(work.epoch); });
  Await([&] { return epochs.size() == 2; }, "the takeover");
  EXPECT_EQ(epochs[1], 2);
  EXPECT_NE(Submit(Registration(2, 1, 1)).find("other has the submap in epoch 2"),
            std::string::npos);
  EXPECT_EQ(answer_state_, Submission::State::kNotLeased);
  registration_t forged = Registration(2, 1, 2);
  forged.header.fact_id += "/forged";
  EXPECT_EQ(Submit(forged), "submap is leased to other");
  EXPECT_EQ(Submit(Registration(2, 1, 2), &other), "");
}

// A mapper that died of SIGSEGV within a step of submap 1, as the process after it tells.
class FailedStepTest : public IngestServiceTest {
 protected:
  FailedStepTest() {
    AddMatchedPhoto(1);
    AddMatchedPhoto(2);
    EXPECT_EQ(Submit(Seed(1, 2)), "");
  }
  void DieWithin(const std::string& step, int64_t life) {
    work_request_t request{};
    request.worker = "mapper-1";
    request.kind = "submap";
    request.previous_exit_signal = SIGSEGV;
    request.previous_life = life;
    request.previous_items = {1};
    request.previous_steps = {step};
    request.num_previous = 1;
    for (int i = 0; i < 2; ++i) peer_->Publish(kWorkRequestChannel, request);  // it repeats it
    Await([&] { return Failure(step, life) != nullptr; }, "the failure of " + step);
  }
  const failure_t* Failure(const std::string& step, int64_t life) const {
    return Find<failure_t>([&](const failure_t& f) {
      return f.header.fact_id == FailedStepFactId(1, step, "life-" + std::to_string(life));
    });
  }
};

TEST_F(FailedStepTest, CountsOnceALifeAndIsLeftOutAfterTheThird) {
  DieWithin("merge 9", 101);
  DieWithin("merge 9", 102);
  EXPECT_EQ(Failure("merge 9", 102)->attempts, 2);
  EXPECT_FALSE(Failure("merge 9", 102)->parked);
  DieWithin("merge 9", 103);
  EXPECT_EQ(Failure("merge 9", 103)->attempts, 3);
  EXPECT_TRUE(Failure("merge 9", 103)->parked);
  EXPECT_EQ(Find<submap_end_t>([](const submap_end_t&) { return true; }), nullptr);
}

TEST_F(FailedStepTest, IsCountedOnAfterARestart) {
  DieWithin("photo 2", 101);
  Restart();
  DieWithin("photo 2", 102);
  EXPECT_EQ(Failure("photo 2", 102)->attempts, 2);
}

TEST_F(FailedStepTest, WithoutWhichThereIsNoSubmapEndsIt) {
  for (const int64_t life : {101, 102, 103}) DieWithin("seed", life);
  Await([&] { return Find<submap_end_t>([](const submap_end_t&) { return true; }) != nullptr; },
        "the submap's end");
}

}  // namespace skein::submission_desk_test
