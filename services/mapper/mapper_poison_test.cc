#include <cmath>
#include <ostream>

#include "testing/mapper_service_rig.h"

namespace skein::mapper_poison_test {

// A photo whose features or matches no map can use: what its blobs hold instead.
struct PoisonedPhoto {
  const char* name;
  std::function<Bytes(Keypoints)> keypoints;  // null: as they are
  std::function<Bytes(TwoViewPairs)> pairs;   // the same
};

std::ostream& operator<<(std::ostream& out, const PoisonedPhoto& poison) {
  return out << poison.name;
}

const Bytes kRubbish = {'r', 'u', 'b', 'b', 'i', 's', 'h'};

// The pairs, each changed.
std::function<Bytes(TwoViewPairs)> EachPair(void (*change)(TwoViewPair*)) {
  return [change](TwoViewPairs pairs) {
    for (TwoViewPair& pair : pairs) change(&pair);
    return EncodeTwoViewPairs(pairs);
  };
}

// The keypoints, each changed.
std::function<Bytes(Keypoints)> EachKeypoint(void (*change)(Keypoint*)) {
  return [change](Keypoints keypoints) {
    for (Keypoint& keypoint : keypoints) change(&keypoint);
    return EncodeKeypoints(keypoints);
  };
}

const std::vector<PoisonedPhoto> kPoisonedPhotos = {
    {"KeypointsDoNotDecode", [](const Keypoints&) { return kRubbish; }, nullptr},
    {"NoKeypoints", [](const Keypoints&) { return EncodeKeypoints({}); }, nullptr},
    {"FewerKeypointsThanMatches",
     [](Keypoints keypoints) {
       keypoints.resize(10);
       return EncodeKeypoints(keypoints);
     },
     nullptr},
    {"KeypointsAreNotFinite", EachKeypoint([](Keypoint* k) { k->x = NAN; }), nullptr},
    {"KeypointsAreFarOutside", EachKeypoint([](Keypoint* k) { k->x = k->y = 1e30F; }), nullptr},
    {"KeypointsAreOnePoint", EachKeypoint([](Keypoint* k) { k->x = k->y = 5; }), nullptr},
    {"PairsDoNotDecode", nullptr, [](const TwoViewPairs&) { return kRubbish; }},
    {"IndicesAreOutOfRange", nullptr, EachPair([](TwoViewPair* pair) {
       for (auto& inlier : pair->inliers) inlier.first = 1U << 30;
     })},
    {"IndicesOfTheOtherAreOutOfRange", nullptr, EachPair([](TwoViewPair* pair) {
       for (auto& inlier : pair->inliers) inlier.second = 1U << 30;
     })},
    {"AllMatchesAreOfOneKeypoint", nullptr, EachPair([](TwoViewPair* pair) {
       for (auto& inlier : pair->inliers) inlier = {0, 0};
     })},
    {"MatchesAreShuffled", nullptr, EachPair([](TwoViewPair* pair) {
       for (size_t i = 1; i < pair->inliers.size(); ++i) {
         std::swap(pair->inliers[i].second, pair->inliers[i - 1].second);
       }
     })},
    {"OthersAreUnknown", nullptr, EachPair([](TwoViewPair* pair) { pair->other_id += 1000; })},
    {"OthersHaveNoValidId", nullptr, EachPair([](TwoViewPair* pair) { pair->other_id = -1; })},
    {"GeometryIsNotFinite", nullptr, EachPair([](TwoViewPair* pair) {
       pair->E.fill(NAN), pair->F.fill(NAN), pair->H.fill(NAN);
       pair->qvec.fill(NAN), pair->tvec.fill(NAN);
       pair->tri_angle_rad = pair->forward_motion = NAN;
     })},
    {"GeometryIsZero", nullptr, EachPair([](TwoViewPair* pair) {
       pair->E.fill(0), pair->F.fill(0), pair->H.fill(0);
       pair->qvec.fill(0), pair->tvec.fill(0);
       pair->geometry = 99;
     })},
};

class PoisonedPhotoTest : public MapperServiceTest,
                          public testing::WithParamInterface<PoisonedPhoto> {
 protected:
  void Poison(int64_t image_id) {
    const PoisonedPhoto& poison = GetParam();
    const PhotoInput& photo = scene_.photos[image_id - 1];
    const TwoViewPairs& pairs = scene_.pairs[image_id - 1];
    if (poison.keypoints) {
      features_t features{};
      features.header.fact_id = "features/poisoned";
      features.image_id = image_id;
      features.keypoints_blob = ingest_node_.blobs().Offer(poison.keypoints(photo.keypoints));
      ingest_.Commit(features);
    }
    matches_t matches{};
    matches.header.fact_id = "matches/" + std::to_string(image_id);
    matches.image_id = image_id;
    for (const TwoViewPair& pair : pairs) {
      two_view_t message{};
      message.other_id = pair.other_id;
      message.num_inliers = static_cast<int32_t>(pair.inliers.size());
      matches.pairs.push_back(message);
    }
    matches.num_pairs = static_cast<int32_t>(matches.pairs.size());
    matches.pairs_blob =
        ingest_node_.blobs().Offer(poison.pairs ? poison.pairs(pairs) : EncodeTwoViewPairs(pairs));
    ingest_.Commit(matches);
  }

  void Finish() {
    CommitFinish(finish_t::DRAINED);
    CommitFinish(finish_t::SETTLED);
    Await([&] { return Find([](const Fact& f) { return IsModel(f, submap_model_t::FINAL); }); },
          "the final model");
  }
};

TEST_P(PoisonedPhotoTest, TheOthersAreRegisteredAlsoByTheNextMapper) {
  Match(1, 4);
  Poison(5);
  Match(6, 8);
  Seed(1, 3);
  CommitLease(kMapper, 1);
  Grant(kMapper);
  const auto others_are_in = [this](int64_t submap_id) {
    std::set<int64_t> ids = Registered(submap_id);
    ids.erase(5);
    return ids.size() == 7;
  };
  Await([&] { return others_are_in(kSubmap); }, "the other photos registered");
  Await([&] { return !States(5).empty(); }, "a word on the poisoned photo");
  Finish();
  CommitFinish(finish_t::DONE);
  // One that starts with this ledger.
  Node node(TestOptions("mapper-2"), loop_, bus_);
  MapperService next(node, ManyHomes());
  Seed(1, 3, 2);
  CommitLease("mapper-2", 1, 2);
  Grant("mapper-2", 2);
  Await([&] { return others_are_in(2); }, "the other photos registered by the next mapper");
}

TEST_P(PoisonedPhotoTest, ASeedOfItBecomesAMapOrEndsWithItsReason) {
  Match(1, 2);
  Poison(3);
  Seed(1, 3);
  CommitLease(kMapper, 1);
  Grant(kMapper);
  Await([&] { return Find(IsEnd) != nullptr || !Registered().empty(); }, "a map or its end");
  if (Find(IsEnd) == nullptr) return;
  EXPECT_NE(std::get<submap_end_t>(*Find(IsEnd)).reason, "");
  Match(4, 8);
  Seed(4, 6, 2);
  CommitLease(kMapper, 1, 2);
  Await([&] { return !holds_submap_; }, "the submap given back");
  Grant(kMapper, 2);
  Await([&] { return IsRegistered(8, 2); }, "photos of another submap registered");
}

INSTANTIATE_TEST_SUITE_P(Table, PoisonedPhotoTest, testing::ValuesIn(kPoisonedPhotos),
                         [](const auto& test) { return std::string(test.param.name); });

// Models that no mapper can take over.
struct PoisonedModel {
  const char* name;
  std::function<Bytes(ModelArchive)> change;
};

std::ostream& operator<<(std::ostream& out, const PoisonedModel& poison) {
  return out << poison.name;
}

std::function<Bytes(ModelArchive)> Without(const char* file) {
  return [file](ModelArchive archive) {
    archive.erase(file);
    return EncodeModelArchive(archive);
  };
}
std::function<Bytes(ModelArchive)> CutShort(const char* file) {
  return [file](ModelArchive archive) {
    archive.at(file).resize(archive.at(file).size() / 2);
    return EncodeModelArchive(archive);
  };
}
std::function<Bytes(ModelArchive)> Garbled(const char* file) {
  return [file](ModelArchive archive) {
    for (size_t i = 8; i < archive.at(file).size(); i += 3) archive.at(file)[i] ^= 0xA5;
    return EncodeModelArchive(archive);
  };
}

const std::vector<PoisonedModel> kPoisonedModels = {
    {"DoesNotDecode", [](const ModelArchive&) { return kRubbish; }},
    {"IsEmpty", [](const ModelArchive&) { return EncodeModelArchive({}); }},
    {"HasNoState", Without("state.bin")},
    {"HasNoImages", Without("images.bin")},
    {"StateIsCutShort", CutShort("state.bin")},
    {"CamerasAreCutShort", CutShort("cameras.bin")},
    {"ImagesAreCutShort", CutShort("images.bin")},
    {"PointsAreCutShort", CutShort("points3D.bin")},
    {"StateIsGarbled", Garbled("state.bin")},
    {"CamerasAreGarbled", Garbled("cameras.bin")},
    {"ImagesAreGarbled", Garbled("images.bin")},
    {"PointsAreGarbled", Garbled("points3D.bin")},
};

class PoisonedModelTest : public MapperServiceTest,
                          public testing::WithParamInterface<PoisonedModel> {
 protected:
  PoisonedModelTest() {
    bus_.Subscribe<work_failed_t>(kWorkFailedChannel,
                                  [this](const work_failed_t& failed) { failed_ = failed; });
  }

  std::string Poisoned(const std::string& model_blob) {
    const Result<ModelArchive> archive =
        DecodeModelArchive(*ingest_node_.blobs().GetLocal(model_blob));
    return ingest_node_.blobs().Offer(GetParam().change(*archive));
  }

  work_failed_t failed_{};
};

TEST_P(PoisonedModelTest, IsReportedAndTheMapperGoesOnWithAnotherSubmap) {
  Match(1, 6);
  Seed(1, 3);
  CommitCheckpoint(Poisoned(MakeModel(1, 6)), 1);
  CommitLease(kMapper, 1);
  Grant(kMapper);
  Await([&] { return failed_.item_id == kSubmap; }, "the failure");
  EXPECT_EQ(failed_.reason.find("checkpoint: "), 0u) << failed_.reason;
  Seed(1, 3, 2);
  CommitLease(kMapper, 1, 2);
  Await([&] { return !holds_submap_; }, "the submap given back");
  Grant(kMapper, 2);
  Await([&] { return IsRegistered(6, 2); }, "photos of another submap registered");
}

TEST_P(PoisonedModelTest, OfASourceLeavesTheTargetAsItWas) {
  Give(8);
  Await([&] { return Registered().size() == 8; }, "all photos registered");
  merge_t merge = Order(2, kSubmap);
  merge.header.fact_id = "merge/frozen";
  merge.state = merge_t::FROZEN;
  merge.model_blob = Poisoned(MakeModel(10, 13));
  ingest_.Commit(merge);
  Await([&] { return Find([](const Fact& f) { return IsMerge(f, merge_t::UNDONE); }); }, "UNDONE");
  Match(9, 9);
  Await([&] { return IsRegistered(9); }, "a photo registered after the merge");
}

INSTANTIATE_TEST_SUITE_P(Table, PoisonedModelTest, testing::ValuesIn(kPoisonedModels),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace skein::mapper_poison_test
