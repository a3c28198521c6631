#include "matching/matching_service.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <new>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "testing/synthetic_features.h"
#include "testing/test_node.h"

namespace skein::matching_service_test {

constexpr double kDeadlineS = 60;

struct Blobs {
  Bytes keypoints, descriptors;
};

Bytes DescriptorsOf(size_t num) { return EncodeDescriptors({Bytes(128 * num, 7)}); }

Blobs CutDescriptors(const Keypoints& keypoints) { return {EncodeKeypoints(keypoints), {1, 2, 3}}; }

// An ingest with photos that gives work, and what matching submits of it.
class Ingest {
 public:
  Ingest(PollLoop& loop, Bus& bus) : node_(TestOptions("ingest"), loop, bus) {
    memory_.Refuse([this](const Fact& fact) { return WhyNotYet(std::get<matches_t>(fact)); });
    bus.Subscribe<work_request_t>(kWorkRequestChannel,
                                  [this](const work_request_t& request) { GiveWork(request); });
    bus.Subscribe<work_failed_t>(kWorkFailedChannel, [this](const work_failed_t& failed) {
      failures_[failed.item_id] = failed;
      work_.erase(failed.item_id);
    });
  }

  void AddPhoto(const PhotoFeatures& photo) {
    image_t image{};
    image.image_id = photo.image_id;
    image.width_px = image.height_px = SyntheticFeatures::kSizePx;
    image.focal_px = SyntheticFeatures::kFocalPx;
    image.focal_from_exif = true;
    Commit(image, "image");
    features_t features;
    features.image_id = photo.image_id;
    features.num_keypoints = static_cast<int32_t>(photo.points.size());
    Keypoints keypoints;
    for (const Eigen::Vector2d& point : photo.points) {
      keypoints.push_back({float(point.x()), float(point.y()), 2, 0, 0, 0, 0});
    }
    Blobs blobs = {EncodeKeypoints(keypoints), EncodeDescriptors({photo.descriptors})};
    const auto damaged = damaged_.find(photo.image_id);
    if (damaged != damaged_.end()) blobs = damaged->second(keypoints);
    features.keypoints_blob = node_.blobs().Offer(blobs.keypoints);
    features.descriptors_blob = node_.blobs().Offer(blobs.descriptors);
    Commit(features, "features");
  }

  void AddCandidates(int64_t image_id, const std::vector<int64_t>& others) {
    candidates_t candidates;
    candidates.image_id = image_id;
    candidates.other_ids = others;
    candidates.distances.assign(others.size(), 0.5f);
    candidates.num_candidates = static_cast<int32_t>(others.size());
    Commit(candidates, "candidates");
  }

  // Committed by another worker; other photo and number of inliers.
  void AddMatches(int64_t image_id, const std::vector<std::pair<int64_t, int32_t>>& pairs) {
    matches_t matches{};
    matches.image_id = image_id;
    for (const auto& [other_id, num_inliers] : pairs) {
      two_view_t pair{};
      pair.other_id = other_id;
      pair.num_inliers = num_inliers;
      matches.pairs.push_back(pair);
    }
    matches.num_pairs = static_cast<int32_t>(pairs.size());
    Commit(matches, "matches");
  }

  void AddWork(int64_t image_id) { work_.insert(image_id); }
  // What the photo's blobs hold instead, by its keypoints.
  using Damaged = std::function<Blobs(Keypoints)>;
  void Damage(int64_t image_id, const Damaged& damaged) { damaged_[image_id] = damaged; }

  const std::map<int64_t, matches_t>& matches() const { return matches_; }
  const std::map<int64_t, work_failed_t>& failures() const { return failures_; }
  Node& node() { return node_; }

 private:
  template <class T>
  void Commit(T fact, const std::string& kind) {
    fact.header.fact_id = kind + "/" + std::to_string(fact.image_id);
    memory_.Commit(Fact(fact));
  }

  void GiveWork(const work_request_t& request) {
    if (request.kind != "matching" || request.capacity < 1) return;
    for (const int64_t item : work_) {
      if (std::count(request.held.begin(), request.held.end(), item)) continue;
      work_t work;
      work.worker = request.worker;
      work.kind = request.kind;
      work.item_id = item;
      work.attempt = 1;
      work.lease_s = 30;
      node_.Publish(kWorkChannel, work);
      return;
    }
  }

  // Matches are committed once their pairs are here.
  std::optional<RefusedFact> WhyNotYet(const matches_t& matches) {
    if (!matches.pairs_blob.empty() && pairs_.count(matches.pairs_blob) == 0) {
      Pull(matches);
      return RefusedFact{submit_reply_t::PULLING, ""};
    }
    work_.erase(matches.image_id);
    matches_[matches.image_id] = matches;
    return std::nullopt;
  }

  void Pull(const matches_t& matches) {
    node_.blobs().Fetch(matches.pairs_blob, matches.header.author,
                        [this, id = matches.pairs_blob](const Result<Bytes>& bytes) {
                          if (bytes.ok()) pairs_[id] = *bytes;
                        });
  }

  Node node_;
  MemoryIngest memory_{node_};
  std::set<int64_t> work_;
  std::map<int64_t, Damaged> damaged_;
  std::map<int64_t, matches_t> matches_;
  std::map<std::string, Bytes> pairs_;
  std::map<int64_t, work_failed_t> failures_;

 public:
  TwoViewPairs PairsOf(int64_t image_id) const {
    return *DecodeTwoViewPairs(pairs_.at(matches_.at(image_id).pairs_blob));
  }
};

class Matching : public testing::Test {
 protected:
  void StartService(bool second_look = true) {
    node_.emplace(TestOptions("matching"), loop_, bus_);
    MatchingServiceOptions options;
    options.second_look = second_look;
    service_.emplace(*node_, options);
  }

  // 1, 2 and 6 see one place, 3 and 4 another; retrieval names 1, 3 and 4 for 6.
  void AddTwoPlaces() {
    for (const int64_t id : {1, 2}) ingest_.AddPhoto(*world_.Photo(id, 0.2 * id, 350));
    for (const int64_t id : {3, 4}) ingest_.AddPhoto(*world_.Photo(id, 0, 0));
    ingest_.AddPhoto(*world_.Photo(6, 1.1, 350));
    ingest_.AddMatches(2, {{1, 300}});
    ingest_.AddMatches(4, {{3, 300}});
    ingest_.AddCandidates(6, {1, 3, 4});
    ingest_.AddWork(6);
  }

  bool RunUntilMatched(size_t num_photos) {
    return loop_.RunUntil([&] { return ingest_.matches().size() == num_photos; }, kDeadlineS);
  }

  std::vector<int64_t> AddPlace(int64_t num) {
    std::vector<int64_t> ids;
    for (int64_t id = 1; id <= num; ++id) {
      ingest_.AddPhoto(*world_.Photo(id, 1.0 / static_cast<double>(id), 300));
      ids.push_back(id);
    }
    return ids;
  }

  PollLoop loop_;
  Bus bus_{"memq://", loop_};
  Ingest ingest_{loop_, bus_};
  std::optional<Node> node_;
  std::optional<MatchingService> service_;
  SyntheticFeatures world_;
};

TEST_F(Matching, SubmitsVerifiedPairsAndAnEmptyFactWithoutCandidates) {
  ingest_.AddPhoto(*world_.Photo(1, 0, 400));
  ingest_.AddPhoto(*world_.Photo(2, 0.5, 200));
  ingest_.AddPhoto(*world_.Photo(3, 1.0, 300));
  ingest_.AddCandidates(1, {});
  ingest_.AddCandidates(3, {2, 1});
  ingest_.AddWork(1);
  ingest_.AddWork(3);
  StartService();
  ASSERT_TRUE(RunUntilMatched(2));
  EXPECT_EQ(ingest_.matches().at(1).num_tried, 0);
  EXPECT_EQ(ingest_.matches().at(1).pairs_blob, "");
  const matches_t& matches = ingest_.matches().at(3);
  EXPECT_EQ(matches.header.fact_id, "matches/3");
  EXPECT_EQ(matches.header.author, "matching");
  EXPECT_EQ(matches.num_tried, 2);
  ASSERT_EQ(matches.num_pairs, 2);
  EXPECT_EQ(matches.pairs[0].other_id, 1);
  EXPECT_EQ(matches.pairs[1].other_id, 2);
  const TwoViewPairs pairs = ingest_.PairsOf(3);
  ASSERT_EQ(pairs.size(), 2u);
  EXPECT_EQ(pairs[0].inliers.size(), static_cast<size_t>(matches.pairs[0].num_inliers));
}

// With one thread, the worker encodes the first photo's pairs when the second one's are ready.
TEST_F(Matching, APhotoFollowsAnotherWithTheSameCandidates) {
  for (const int64_t id : {1, 2, 3}) ingest_.AddPhoto(*world_.Photo(id, 0.3 * id, 300));
  for (const int64_t id : {5, 6}) {
    ingest_.AddPhoto(*world_.Photo(id, 0.1 * id, 350));
    ingest_.AddWork(id);
  }
  StartService();
  EXPECT_FALSE(loop_.RunUntil([&] { return !ingest_.matches().empty(); }, 0.5)) << "holds both";
  for (const int64_t id : {5, 6}) ingest_.AddCandidates(id, {1, 2, 3});
  ASSERT_TRUE(RunUntilMatched(2));
  for (const int64_t id : {5, 6}) EXPECT_GE(ingest_.matches().at(id).num_pairs, 3) << id;
}

TEST_F(Matching, WaitsForCandidatesThatTheLedgerBringsLater) {
  ingest_.AddPhoto(*world_.Photo(1, 0, 400));
  ingest_.AddWork(2);
  StartService();
  EXPECT_FALSE(loop_.RunUntil([&] { return !ingest_.matches().empty(); }, 0.2));
  ingest_.AddPhoto(*world_.Photo(2, 1, 300));
  ingest_.AddCandidates(2, {1});
  ASSERT_TRUE(RunUntilMatched(1));
  EXPECT_EQ(ingest_.matches().at(2).num_pairs, 1);
}

TEST_F(Matching, LeavesOutCandidatesThatCannotBeUsed) {
  ingest_.Damage(2, CutDescriptors);
  ingest_.AddPhoto(*world_.Photo(1, 0, 400));
  ingest_.AddPhoto(*world_.Photo(2, 0.5, 200));
  ingest_.AddPhoto(*world_.Photo(3, 1, 300));
  ingest_.AddCandidates(3, {2, 1, 1, 3, 77, -5});
  ingest_.AddWork(3);
  StartService();
  ASSERT_TRUE(RunUntilMatched(1));
  EXPECT_EQ(ingest_.matches().at(3).num_tried, 1);
  EXPECT_EQ(ingest_.matches().at(3).num_pairs, 1);
}

TEST_F(Matching, SecondLookSparesWhatFailsAndFindsWhatRetrievalMissed) {
  AddTwoPlaces();
  StartService();
  ASSERT_TRUE(RunUntilMatched(1));
  const matches_t& matches = ingest_.matches().at(6);
  EXPECT_EQ(matches.num_tried, 3) << "1, 3, and 2 through 1; not 4, for which 3 spoke";
  ASSERT_EQ(matches.num_pairs, 2);
  EXPECT_EQ(std::set<int64_t>({matches.pairs[0].other_id, matches.pairs[1].other_id}),
            std::set<int64_t>({1, 2}));
  EXPECT_GE(matches.pairs[0].num_inliers, matches.pairs[1].num_inliers);
  EXPECT_EQ(ingest_.PairsOf(6).size(), 2u);
}

// The 31st candidate is the only one that overlaps.
TEST_F(Matching, ALonelyPhotoIsComparedWithFurtherCandidates) {
  std::vector<int64_t> candidates;
  for (int64_t id = 1; id <= 30; ++id) {
    ingest_.AddPhoto(*world_.Photo(id, 0, 0));
    candidates.push_back(id);
  }
  ingest_.AddPhoto(*world_.Photo(31, 0.2, 350));
  candidates.push_back(31);
  ingest_.AddPhoto(*world_.Photo(40, 1.1, 350));
  ingest_.AddCandidates(40, candidates);
  ingest_.AddWork(40);
  StartService();
  ASSERT_TRUE(RunUntilMatched(1));
  ASSERT_EQ(ingest_.matches().at(40).num_pairs, 1);
  EXPECT_EQ(ingest_.matches().at(40).pairs[0].other_id, 31);
  EXPECT_EQ(ingest_.matches().at(40).num_tried, 31);
}

TEST_F(Matching, WithoutSecondLookTheCandidatesAloneAreMatched) {
  AddTwoPlaces();
  StartService(false);
  ASSERT_TRUE(RunUntilMatched(1));
  EXPECT_EQ(ingest_.matches().at(6).num_tried, 3) << "1, 3 and 4";
  EXPECT_EQ(ingest_.matches().at(6).num_pairs, 1);
}

TEST_F(Matching, ReportsAPhotoWithDamagedFeatures) {
  ingest_.Damage(1, CutDescriptors);
  ingest_.AddPhoto(*world_.Photo(1, 0, 400));
  ingest_.AddCandidates(1, {});
  ingest_.AddWork(1);
  StartService();
  ASSERT_TRUE(loop_.RunUntil([&] { return !ingest_.failures().empty(); }, kDeadlineS));
  EXPECT_EQ(ingest_.failures().at(1).reason, "features of image 1: SKDS: too short for a header");
  EXPECT_EQ(node_->bus().counters().num_decode_failures, 0);
}

// One pair of several: either photo may be to blame, so the pair alone goes.
TEST_F(Matching, APairThatThrowsIsLeftOut) {
  ingest_.AddPhoto(*world_.Photo(1, 0, 400));
  ingest_.AddPhoto(*world_.Photo(2, 0.5, 300));
  ingest_.AddPhoto(*world_.Photo(3, 1, 300));
  ingest_.AddCandidates(2, {1});
  ingest_.AddCandidates(3, {1, 2});
  ingest_.AddWork(2);
  ingest_.AddWork(3);
  StartService();
  service_->OnPair([](int64_t, int64_t other_id) {
    if (other_id == 1) throw std::runtime_error("no model");
  });
  ASSERT_TRUE(RunUntilMatched(2));
  EXPECT_EQ(ingest_.matches().at(2).num_tried, 0);
  EXPECT_EQ(ingest_.matches().at(3).num_tried, 1);
  EXPECT_EQ(ingest_.matches().at(3).num_pairs, 1);
  EXPECT_TRUE(ingest_.failures().empty());
}

// Ingest counts such failures and parks the photo after a few.
TEST_F(Matching, APhotoWhosePairsAllThrowFailsForNow) {
  const std::vector<int64_t> place = AddPlace(3);
  for (const int64_t id : {5, 6}) {
    ingest_.AddPhoto(*world_.Photo(id, 0.1 * id, 350));
    ingest_.AddCandidates(id, place);
    ingest_.AddWork(id);
  }
  StartService();
  service_->OnPair([](int64_t image_id, int64_t) {
    if (image_id == 6) throw std::bad_alloc();
  });
  ASSERT_TRUE(loop_.RunUntil([&] { return !ingest_.failures().empty(); }, kDeadlineS));
  EXPECT_EQ(ingest_.failures().at(6).reason, std::bad_alloc().what());
  EXPECT_FALSE(ingest_.failures().at(6).permanent);
  ASSERT_TRUE(RunUntilMatched(1));
  EXPECT_EQ(ingest_.matches().at(5).num_pairs, 3);
}

// Each is reported, and a photo that has it as a candidate is matched with the others.
TEST_F(Matching, FeaturesThatCannotBeUsedHoldUpNobody) {
  const auto with_first_x = [](float x) {
    return [x](Keypoints keypoints) -> Blobs {
      keypoints.front().x = x;
      return {EncodeKeypoints(keypoints), DescriptorsOf(keypoints.size())};
    };
  };
  const std::vector<Ingest::Damaged> table = {
      [](const Keypoints&) -> Blobs {
        return {{}, {}};
      },
      [](const Keypoints& k) -> Blobs {
        return {{1, 2, 3}, DescriptorsOf(k.size())};
      },
      [](const Keypoints& k) -> Blobs {
        return {DescriptorsOf(k.size()), EncodeKeypoints(k)};
      },
      [](const Keypoints& k) -> Blobs {
        return {EncodeKeypoints(k), DescriptorsOf(k.size() - 1)};
      },
      with_first_x(NAN),
      with_first_x(-1),
      with_first_x(1e30F),
  };
  const int64_t good = 100, next = 101;
  ingest_.AddPhoto(*world_.Photo(good, 0.5, 200));
  std::vector<int64_t> candidates = {good};
  for (size_t i = 0; i < table.size(); ++i) {
    const auto id = static_cast<int64_t>(i) + 1;
    ingest_.Damage(id, table[i]);
    ingest_.AddPhoto(*world_.Photo(id, 0, 400));
    ingest_.AddCandidates(id, {});
    ingest_.AddWork(id);
    candidates.push_back(id);
  }
  ingest_.AddPhoto(*world_.Photo(next, 1, 300));
  ingest_.AddCandidates(next, candidates);
  ingest_.AddWork(next);
  StartService();
  ASSERT_TRUE(RunUntilMatched(1));
  EXPECT_EQ(ingest_.matches().at(next).num_tried, 1);
  ASSERT_TRUE(
      loop_.RunUntil([&] { return ingest_.failures().size() == table.size(); }, kDeadlineS));
  for (const auto& [id, failed] : ingest_.failures()) {
    EXPECT_NE(failed.reason.find("features of image"), std::string::npos) << failed.reason;
  }
}

}  // namespace skein::matching_service_test
