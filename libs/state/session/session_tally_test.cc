#include "session/session_tally.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "ledger/fact_ids.h"
#include "session/report.h"
#include "session/troubles.h"
#include "testing/test_ledger.h"

namespace skein::session_tally_test {

class TallyTest : public testing::Test, protected TestLedger {
 protected:
  void Photo(int64_t id) {
    image_t image{};
    image.image_id = id;
    image.size_bytes = 1000;
    image.received_utime_us = (head() + 1) * 1'000'000 - 200'000;
    Commit(image);
  }
  void Features(int64_t id) {
    features_t features{};
    features.image_id = id;
    Commit(features);
  }
  void Candidates(int64_t id) {
    candidates_t candidates{};
    candidates.image_id = id;
    Commit(candidates);
  }
  void Matches(int64_t id, bool has_pairs = true) {
    matches_t matches{};
    matches.image_id = id;
    matches.pairs_blob = has_pairs ? "blob" : "";
    Commit(matches);
  }
  void Matched(int64_t id) {
    Photo(id);
    Features(id);
    Candidates(id);
    Matches(id);
  }
  void Park(int64_t id) {
    failure_t failure{};
    failure.image_id = id;
    failure.stage = "features";
    failure.parked = 1;
    Commit(failure);
  }
  int64_t NumIn(PhotoPhase phase) const { return tally().NumIn(phase); }

  // The counts of report.json and of the backlog, which look at every photo.
  void ExpectCountsOfAllPhotos() const {
    const PhotoCounts counts = CountPhotos(session(), 0);
    const StageBacklog backlog = BacklogOf(state());
    EXPECT_EQ(NumIn(PhotoPhase::kRegistered), counts.registered);
    EXPECT_EQ(NumIn(PhotoPhase::kFailed) + session().history.num_refused(), counts.failed);
    EXPECT_EQ(NumIn(PhotoPhase::kFeatures), backlog.features);
    EXPECT_EQ(NumIn(PhotoPhase::kRetrieval), backlog.retrieval);
    EXPECT_EQ(NumIn(PhotoPhase::kMatching), backlog.matching);
    EXPECT_EQ(backlog.features + backlog.retrieval + backlog.matching + NumIn(PhotoPhase::kMapper) +
                  NumIn(PhotoPhase::kUnplaced),
              counts.deferred);
    int64_t num_latencies = 0;
    for (const int64_t photos : tally().latency().photos) num_latencies += photos;
    const std::vector<double> seconds = PhotoToPoseSeconds(session());
    EXPECT_EQ(num_latencies, static_cast<int64_t>(seconds.size()));
    double sum_s = 0;
    for (const double s : seconds) sum_s += s;
    EXPECT_NEAR(tally().latency().sum_s, sum_s, 1e-6 * std::max(1.0, sum_s));
  }
};

TEST_F(TallyTest, APhotoWaitsForOneStageAfterTheOther) {
  const auto expect_only = [this](PhotoPhase phase) {
    for (size_t i = 0; i < kNumPhotoPhases; ++i) {
      EXPECT_EQ(NumIn(static_cast<PhotoPhase>(i)), i == static_cast<size_t>(phase)) << i;
    }
    ExpectCountsOfAllPhotos();
  };
  Photo(1);
  expect_only(PhotoPhase::kFeatures);
  Features(1);
  expect_only(PhotoPhase::kRetrieval);
  Candidates(1);
  expect_only(PhotoPhase::kMatching);
  Matches(1);
  expect_only(PhotoPhase::kMapper);
  Register(5, 1, registration_t::DEFERRED);
  expect_only(PhotoPhase::kUnplaced);
  Register(5, 1);
  expect_only(PhotoPhase::kRegistered);
  Register(5, 1, registration_t::WITHDRAWN);
  expect_only(PhotoPhase::kUnplaced);
  EXPECT_EQ(tally().photo_bytes(), 1000);
}

TEST_F(TallyTest, APhotoWithoutPairsWaitsForNoMapper) {
  Photo(1);
  Features(1);
  Candidates(1);
  Matches(1, false);
  EXPECT_EQ(NumIn(PhotoPhase::kUnplaced), 1);
}

TEST_F(TallyTest, TheOldestIsTheOneThatCameToTheStageFirst) {
  EXPECT_FALSE(tally().OldestUtimeUs(PhotoPhase::kFeatures).has_value());
  Photo(1);  // at 1 s
  Photo(2);  // at 2 s
  EXPECT_EQ(tally().OldestUtimeUs(PhotoPhase::kFeatures), 1'000'000);
  Features(1);  // at 3 s
  EXPECT_EQ(tally().OldestUtimeUs(PhotoPhase::kFeatures), 2'000'000);
  EXPECT_EQ(tally().OldestUtimeUs(PhotoPhase::kRetrieval), 3'000'000);
  Park(2);
  EXPECT_FALSE(tally().OldestUtimeUs(PhotoPhase::kFeatures).has_value());
}

TEST_F(TallyTest, PhotosOfASubmapThatEndsWaitAgain) {
  for (const int64_t id : {1, 2, 3}) Matched(id);
  Register(5, 1);
  Register(5, 2);
  Register(6, 2);
  Register(5, 3, registration_t::REJECTED);
  EXPECT_EQ(NumIn(PhotoPhase::kRegistered), 2);
  End(5);
  EXPECT_EQ(NumIn(PhotoPhase::kRegistered), 1) << "submap 6 has photo 2";
  EXPECT_EQ(NumIn(PhotoPhase::kMapper), 2);
  ExpectCountsOfAllPhotos();
}

TEST_F(TallyTest, AMergeThatIsDoneEndsItsSource) {
  for (const int64_t id : {1, 2}) Matched(id);
  Register(5, 1);
  Register(6, 2);
  const int64_t merge_id = Order(5, 6);
  Register(6, 1);
  EXPECT_EQ(NumIn(PhotoPhase::kRegistered), 2);
  MergeStep(merge_id, merge_t::DONE);
  EXPECT_EQ(NumIn(PhotoPhase::kRegistered), 2);
  ExpectCountsOfAllPhotos();
}

TEST_F(TallyTest, ALatencyIsThatOfTheFirstRegistration) {
  Matched(1);      // received at 0.8 s
  Register(5, 1);  // at 5 s
  Register(6, 1);  // at 6 s
  EXPECT_NEAR(tally().latency().sum_s, 4.2, 1e-9);
  EXPECT_EQ(tally().latency().photos[5], 1) << "2.5 to 5 s";
}

TEST_F(TallyTest, AClockThatWasSetBackMakesNoNegativeLatency) {
  image_t image{};
  image.image_id = 1;
  image.received_utime_us = 90'000'000;
  Commit(image);
  Register(5, 1);
  EXPECT_EQ(tally().latency().sum_s, 0);
  EXPECT_EQ(tally().latency().photos[0], 1);
}

// In an order that no session has, too.
TEST_F(TallyTest, CountsAreThoseOfAllPhotosAfterAnyFacts) {
  const unsigned seed = 39;
  std::mt19937 random(seed);
  const auto below = [&random](int n) { return static_cast<int64_t>(random() % n); };
  int64_t num_photos = 0, num_submaps = 1;
  for (int i = 0; i < 3000; ++i) {
    const int64_t id = 1 + below(static_cast<int>(num_photos) + 1);
    const int64_t submap = 1 + below(static_cast<int>(num_submaps));
    switch (below(10)) {
      case 0:
      case 1:
        Matched(++num_photos);
        break;
      case 2:
        Photo(++num_photos);
        break;
      case 3:
        Park(id);
        break;
      case 4:
        if (below(6) == 0) End(submap);
        break;
      case 5:
        ++num_submaps;
        break;
      default:
        if (id <= num_photos && state().FindPhoto(id)->matches_seq > 0) {
          Register(submap, id, static_cast<int8_t>(1 + below(4)));
        }
    }
    if (i % 50 == 0) ExpectCountsOfAllPhotos();
    ASSERT_FALSE(HasFailure()) << "seed " << seed << ", fact " << head();
  }
}

TEST_F(TallyTest, RefusedPhotosCountUntilTheyCome) {
  failure_t refusal{};
  refusal.stage = "ingest";
  Commit(refusal);
  refusal.header.fact_id = VanishedAgentFactId("photo", 1);
  Commit(refusal);
  EXPECT_EQ(session().history.num_refused(), 2);
  image_t image{};
  image.image_id = 1;
  image.blob_id = "photo";
  Commit(image);
  EXPECT_EQ(session().history.num_refused(), 1);
  ExpectCountsOfAllPhotos();
}

}  // namespace skein::session_tally_test
