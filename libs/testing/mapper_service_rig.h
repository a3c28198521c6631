// The whole service on an in-process bus, against an ingest that keeps its ledger in memory and
// refuses what the test says. The photos are those of a synthetic scene.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "formats/shape.h"
#include "ledger/fact_ids.h"
#include "mapper/mapper_service.h"
#include "mapping/checkpoint.h"
#include "session/submap_facts.h"
#include "testing/synthetic_scene.h"
#include "testing/test_node.h"

namespace skein {

constexpr double kDeadlineS = 60;
constexpr int64_t kSubmap = 1;
constexpr char kMapper[] = "mapper-1";

inline SyntheticOptions Scene() {
  SyntheticOptions options;
  options.num_photos = 13;
  return options;
}

inline SubmapRunOptions RunOptions() {
  SubmapRunOptions options;
  options.checkpoint.period_s = 0.3;
  return options;
}

// Two submaps grow over the whole scene, so that they can merge.
inline SubmapRunOptions ManyHomes() {
  SubmapRunOptions options = RunOptions();
  options.one_home = false;
  return options;
}

inline bool IsRegistration(const Fact& fact, int64_t image_id) {
  const auto* r = std::get_if<registration_t>(&fact);
  return r != nullptr && r->image_id == image_id && r->state == registration_t::REGISTERED;
}

inline bool IsModel(const Fact& fact, int8_t kind) {
  const auto* model = std::get_if<submap_model_t>(&fact);
  return model != nullptr && model->kind == kind;
}

inline bool IsEnd(const Fact& fact) { return std::holds_alternative<submap_end_t>(fact); }

inline bool IsMerge(const Fact& fact, int8_t state) {
  const auto* merge = std::get_if<merge_t>(&fact);
  return merge != nullptr && merge->state == state;
}

class MapperServiceTest : public testing::Test {
 protected:
  explicit MapperServiceTest(const SubmapRunOptions& options = RunOptions(),
                             double share_after_s = kShareAfterS)
      : service_(node_, options, 0, share_after_s) {
    bus_.Subscribe<work_request_t>(kWorkRequestChannel, [this](const work_request_t& request) {
      holds_submap_ = request.num_held > 0;
      capacity_ = request.capacity;
    });
    bus_.Subscribe<shared_reply_t>(kSharedReplyChannel,
                                   [this](const shared_reply_t&) { ++num_answers_; });
    for (size_t i = 0; i < scene_.photos.size(); ++i) AddFeatures(i);
  }

  void Await(const std::function<bool()>& condition, const std::string& what) {
    ASSERT_TRUE(loop_.RunUntil(condition, kDeadlineS)) << "never happened: " << what;
  }

  // Photo ids are the scene's indices plus one.
  void AddFeatures(size_t i) {
    const PhotoInput& photo = scene_.photos[i];
    image_t image{};
    image.header.fact_id = "image/" + std::to_string(photo.image_id);
    image.image_id = photo.image_id;
    image.camera_id = photo.camera_id;
    image.agent = "alice";
    image.name = photo.name;
    image.width_px = photo.width_px;
    image.height_px = photo.height_px;
    image.focal_px = photo.focal_px;
    image.focal_from_exif = photo.focal_from_exif;
    ingest_.Commit(image);
    features_t features{};
    features.header.fact_id = "features/" + std::to_string(photo.image_id);
    features.image_id = photo.image_id;
    features.keypoints_blob = ingest_node_.blobs().Offer(EncodeKeypoints(photo.keypoints));
    ingest_.Commit(features);
  }

  void Match(int64_t first, int64_t last, int8_t geometry = 0) {
    for (int64_t id = first; id <= last; ++id) {
      matches_t matches{};
      matches.header.fact_id = "matches/" + std::to_string(id);
      matches.image_id = id;
      for (const TwoViewPair& pair : scene_.pairs[id - 1]) {
        two_view_t message{};
        message.other_id = pair.other_id;
        message.num_inliers = static_cast<int32_t>(pair.inliers.size());
        message.geometry = geometry;
        matches.pairs.push_back(message);
      }
      matches.num_pairs = static_cast<int32_t>(matches.pairs.size());
      if (matches.num_pairs > 0) {
        matches.pairs_blob = ingest_node_.blobs().Offer(EncodeTwoViewPairs(scene_.pairs[id - 1]));
      }
      ingest_.Commit(matches);
    }
  }

  void Seed(int64_t image_id1, int64_t image_id2, int64_t submap_id = kSubmap) {
    seed_t seed{};
    seed.header.fact_id = "seed/" + std::to_string(submap_id);
    seed.submap_id = submap_id;
    seed.image_id1 = image_id1;
    seed.image_id2 = image_id2;
    seed.num_inliers = 100;
    seed.tri_angle_rad = 0.28F;
    ingest_.Commit(seed);
  }

  void CommitLease(const std::string& owner, int64_t epoch, int64_t submap_id = kSubmap) {
    submap_lease_t lease{};
    lease.header.fact_id = "lease/" + std::to_string(submap_id) + "/" + std::to_string(epoch);
    lease.submap_id = submap_id;
    lease.epoch = epoch;
    lease.owner = owner;
    ingest_.Commit(lease);
  }

  void Grant(const std::string& owner, int64_t submap_id = kSubmap, int64_t epoch = 1) {
    work_t work{};
    work.worker = owner;
    work.kind = "submap";
    work.item_id = submap_id;
    work.epoch = epoch;
    work.lease_s = 5;
    ingest_node_.Publish(kWorkChannel, work);
  }

  // Delivers what was committed before: services that join the bus from here on must ask for it.
  void DeliverCommitted() {
    bool delivered = false;
    const auto id = bus_.Subscribe<shared_request_t>(
        kSharedRequestChannel, [&](const shared_request_t&) { delivered = true; });
    Ask({});
    Await([&] { return delivered; }, "messages of earlier facts");
    bus_.Unsubscribe(id);
  }

  // Gives the mapper a submap of the photos up to `last`.
  void Give(int64_t last, int8_t geometry = 0) {
    Match(1, last, geometry);
    Seed(1, 3);
    CommitLease(kMapper, 1);
    Grant(kMapper);
  }

  void CommitCheckpoint(const std::string& blob_id, int number) {
    submap_model_t model{};
    model.submap_id = kSubmap;
    model.epoch = 1;
    model.kind = submap_model_t::CHECKPOINT;
    model.model_blob = blob_id;
    model.header.fact_id = SubmapModelFactId(kSubmap, 1, number);
    ingest_.Commit(model);
  }

  void CommitRegistration(int64_t image_id, int64_t submap_id) {
    registration_t registration{};
    registration.header.fact_id =
        "registration/earlier/" + std::to_string(image_id) + "/" + std::to_string(submap_id);
    registration.image_id = image_id;
    registration.submap_id = submap_id;
    registration.state = registration_t::REGISTERED;
    ingest_.Commit(registration);
  }

  void Ask(const std::vector<int64_t>& image_ids, int64_t submap_id = kSubmap) {
    shared_request_t request{};
    request.submap_id = submap_id;
    request.image_ids = image_ids;
    request.num_images = static_cast<int32_t>(image_ids.size());
    ingest_node_.Publish(kSharedRequestChannel, request);
  }

  // Refuses the first `count` submissions that `matches` fits.
  void RefuseFirst(int count, int8_t status, const std::string& reason,
                   std::function<bool(const Fact&)> matches) {
    auto left = std::make_shared<int>(count);
    ingest_.Refuse([=](const Fact& fact) -> std::optional<RefusedFact> {
      if (*left == 0 || !matches(fact)) return std::nullopt;
      --*left;
      return RefusedFact{status, reason};
    });
  }

  // As the mapper of a second submap.
  void HoldElsewhere(int64_t first, int64_t last) {
    seed_t seed{};
    seed.header.fact_id = "seed/elsewhere";
    seed.submap_id = kSubmap + 1;
    ingest_.Commit(seed);
    for (int64_t id = first; id <= last; ++id) CommitRegistration(id, kSubmap + 1);
  }

  void CommitFinish(int8_t state) {
    finish_t finish{};
    finish.header.fact_id = "finish/" + std::to_string(state);
    finish.finish_id = 1;
    finish.state = state;
    ingest_.Commit(finish);
  }

  merge_t Order(int64_t source, int64_t target) {
    merge_t order{};
    order.header.fact_id = "merge";
    order.state = merge_t::ORDERED;
    order.merge_id = static_cast<int64_t>(ingest_.facts().size()) + 1;
    order.source_id = source;
    order.target_id = target;
    order.target_from_source_scale = 1;
    order.target_from_source_qwxyz[0] = 1;
    order.num_shared_images = 4;
    ingest_.Commit(order);
    return order;
  }

  // The model of a submap that another mapper made of these photos.
  std::string MakeModel(int64_t first, int64_t last) {
    Submap submap{SubmapOptions()};
    const auto ignore = [](const PhotoEvent&) {};
    for (int64_t id = first; id <= last; ++id) {
      EXPECT_TRUE(submap.AddPhoto(scene_.photos[id - 1]).ok());
      EXPECT_TRUE(submap.AddPairs(id, scene_.pairs[id - 1]).ok());
    }
    InitialPairOptions options;
    options.min_triangulation_angle_deg = 8;
    EXPECT_TRUE(submap.Start(options, first, first + 2, ignore).status.ok());
    for (int64_t id = first; id <= last; ++id) submap.Enqueue(id);
    while (submap.Step(ignore)) continue;
    EXPECT_EQ(submap.Statistics().num_images, last - first + 1);
    return ingest_node_.blobs().Offer(EncodeModelArchive(SaveSubmap(&submap)));
  }

  // The submap has photos 1 to 8; a merge brings it those of a source.
  void FreezeForATargetOfEight(int64_t first, int64_t last) {
    Give(8);
    Await([&] { return Registered().size() == 8; }, "all photos registered");
    merge_t merge = Order(2, kSubmap);
    merge.header.fact_id = "merge/frozen";
    merge.state = merge_t::FROZEN;
    merge.model_blob = MakeModel(first, last);
    ingest_.Commit(merge);
  }

  // Somebody looks at the maps.
  void WantShapes() {
    shape_wanted_t wanted{};
    wanted.author = "ingest";
    ingest_node_.Publish(kShapeWantedChannel, wanted);
  }
  // A blob of the mapper's shape.
  Bytes FetchShape(const std::string& blob_id) {
    Bytes fetched;
    bool done = false;
    ingest_node_.blobs().Fetch(blob_id, kMapper, [&](Result<Bytes> bytes) {
      EXPECT_TRUE(bytes.ok()) << bytes.error();
      if (bytes.ok()) fetched = std::move(*bytes);
      done = true;
    });
    Await([&] { return done; }, "a blob of the shape");
    return fetched;
  }

  const Fact* Find(const std::function<bool(const Fact&)>& matches) const {
    const auto& facts = ingest_.facts();
    const auto found = std::find_if(facts.rbegin(), facts.rend(), matches);
    return found == facts.rend() ? nullptr : &*found;
  }

  // States of a photo in the ledger, in order: in all submaps, or in one.
  std::vector<int> States(int64_t image_id, int64_t submap_id = 0) const {
    std::vector<int> states;
    for (const Fact& fact : ingest_.facts()) {
      const auto* r = std::get_if<registration_t>(&fact);
      if (r == nullptr || r->image_id != image_id) continue;
      if (submap_id == 0 || r->submap_id == submap_id) states.push_back(r->state);
    }
    return states;
  }
  bool IsRegistered(int64_t image_id, int64_t submap_id = 0) const {
    const std::vector<int> states = States(image_id, submap_id);
    return !states.empty() && states.back() == registration_t::REGISTERED;
  }
  std::set<int64_t> Registered(int64_t submap_id = 0) const {
    std::set<int64_t> ids;
    for (const PhotoInput& photo : scene_.photos) {
      if (IsRegistered(photo.image_id, submap_id)) ids.insert(photo.image_id);
    }
    return ids;
  }

  const SyntheticScene scene_ = MakeScene(Scene());
  PollLoop loop_;
  Bus bus_{"memq://", loop_};
  Node ingest_node_{TestOptions("ingest"), loop_, bus_};
  Node node_{TestOptions(kMapper), loop_, bus_};
  MemoryIngest ingest_{ingest_node_};
  bool holds_submap_ = false;
  int capacity_ = 0;
  int num_answers_ = 0;
  MapperService service_;
};

}  // namespace skein
