// The whole service on an in-process bus, against an ingest that keeps its ledger in memory and
// refuses what the test says. The photos are those of a synthetic scene.
#include "mapper/mapper_service.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <ostream>
#include <set>
#include <string>
#include <vector>

#include "formats/shape.h"
#include "ledger/fact_ids.h"
#include "mapping/checkpoint.h"
#include "session/submap_facts.h"
#include "testing/synthetic_scene.h"
#include "testing/test_node.h"

namespace skein {
namespace {

constexpr double kDeadlineS = 60;
constexpr int64_t kSubmap = 1;
constexpr char kMapper[] = "mapper-1";

SyntheticOptions Scene() {
  SyntheticOptions options;
  options.num_photos = 13;
  return options;
}

SubmapRunOptions RunOptions() {
  SubmapRunOptions options;
  options.checkpoint.period_s = 0.3;
  return options;
}

// Two submaps grow over the whole scene, so that they can merge.
SubmapRunOptions ManyHomes() {
  SubmapRunOptions options = RunOptions();
  options.one_home = false;
  return options;
}

// Takes what waits without leaving a pool time.
PoolOptions SharesAtOnce() {
  PoolOptions options;
  options.sharing.after_s = 0;
  return options;
}

bool IsRegistration(const Fact& fact, int64_t image_id) {
  const auto* r = std::get_if<registration_t>(&fact);
  return r != nullptr && r->image_id == image_id && r->state == registration_t::REGISTERED;
}

bool IsModel(const Fact& fact, int8_t kind) {
  const auto* model = std::get_if<submap_model_t>(&fact);
  return model != nullptr && model->kind == kind;
}

bool IsEnd(const Fact& fact) { return std::holds_alternative<submap_end_t>(fact); }

bool IsMerge(const Fact& fact, int8_t state) {
  const auto* merge = std::get_if<merge_t>(&fact);
  return merge != nullptr && merge->state == state;
}

class MapperServiceTest : public testing::Test {
 protected:
  MapperServiceTest() : MapperServiceTest(RunOptions(), PoolOptions()) {}
  MapperServiceTest(const SubmapRunOptions& run_options, const PoolOptions& pool_options)
      : service_(node_, run_options, pool_options) {
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

  void Match(int64_t first, int64_t last) {
    for (int64_t id = first; id <= last; ++id) {
      matches_t matches{};
      matches.header.fact_id = "matches/" + std::to_string(id);
      matches.image_id = id;
      for (const TwoViewPair& pair : scene_.pairs[id - 1]) {
        two_view_t message{};
        message.other_id = pair.other_id;
        message.num_inliers = static_cast<int32_t>(pair.inliers.size());
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

  void Grant(const std::string& owner, int64_t submap_id = kSubmap) {
    work_t work{};
    work.worker = owner;
    work.kind = "submap";
    work.item_id = submap_id;
    work.epoch = 1;
    work.lease_s = 5;
    ingest_node_.Publish(kWorkChannel, work);
  }

  // Who comes to the bus from here on must ask for what was committed before.
  void DeliverCommitted() {
    bool delivered = false;
    const auto id = bus_.Subscribe<shared_request_t>(
        kSharedRequestChannel, [&](const shared_request_t&) { delivered = true; });
    Ask({});
    Await([&] { return delivered; }, "messages of earlier facts");
    bus_.Unsubscribe(id);
  }

  // Gives the mapper a submap of the photos up to `last`.
  void Give(int64_t last) {
    Match(1, last);
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
    ingest_.Refuse([=](const Fact& fact) -> std::optional<Refusal> {
      if (*left == 0 || !matches(fact)) return std::nullopt;
      --*left;
      return Refusal{status, reason};
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

  // What the ledger holds of a photo, in order: of all submaps, or of one.
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

TEST_F(MapperServiceTest, RegistersThePhotosOfItsSubmap) {
  Give(8);
  Await([&] { return Registered().size() == 8; }, "all photos registered");
  EXPECT_TRUE(holds_submap_);
}

TEST_F(MapperServiceTest, TellsTheShapeOfItsMapWhileSomebodyLooks) {
  submap_shape_t told{};
  int num_told = 0;
  bus_.Subscribe<submap_shape_t>(kSubmapShapeChannel, [&](const submap_shape_t& shape) {
    told = shape;
    ++num_told;
  });
  Give(6);
  Await([&] { return Registered().size() == 6; }, "all photos registered");
  EXPECT_FALSE(loop_.RunUntil([&] { return num_told > 0; }, 1.5)) << "nobody looks";
  WantShapes();
  Await([&] { return num_told > 0; }, "a shape");
  EXPECT_EQ(told.submap_id, kSubmap);
  EXPECT_EQ(told.epoch, 1);
  EXPECT_EQ(told.owner, kMapper);
  EXPECT_EQ(told.num_images, 6);
  const Result<ShapeManifest> manifest = DecodeShapeManifest(FetchShape(told.manifest_blob));
  ASSERT_TRUE(manifest.ok()) << manifest.error();
  EXPECT_EQ(manifest->photos.size(), 6u);
  EXPECT_EQ(static_cast<int64_t>(manifest->version), told.version);
  int64_t num_points = 0;
  for (const ShapeManifest::Chunk& chunk : manifest->chunks) {
    const Result<ShapeChunk> points = DecodeShapeChunk(FetchShape(chunk.points_blob));
    const Result<PointTracks> tracks = DecodePointTracks(FetchShape(chunk.tracks_blob));
    ASSERT_TRUE(points.ok() && tracks.ok());
    EXPECT_EQ(points->points.size(), tracks->ends.size());
    num_points += static_cast<int64_t>(points->points.size());
  }
  EXPECT_GT(num_points, 100);
  EXPECT_EQ(num_points, told.num_points);

  // It is told again, and anew when the map grows.
  const int64_t version = told.version;
  const int before = num_told;
  Await([&] { return num_told > before; }, "the shape once more");
  WantShapes();
  Match(7, 8);
  Await([&] { return told.num_images == 8; }, "a shape with the new photos");
  EXPECT_GT(told.version, version);
}

// It is loaded for a comparison, and its matches contradict a map without it.
TEST_F(MapperServiceTest, AFinishLeavesAPhotoToTheSubmapThatHoldsIt) {
  Give(7);
  Await([&] { return Registered().size() == 7; }, "all photos registered");
  HoldElsewhere(8, 10);
  Match(8, 8);
  Ask({8});
  Await([&] { return num_answers_ == 1; }, "the answer");
  CommitFinish(finish_t::DRAINED);
  CommitFinish(finish_t::SETTLED);
  Await([&] { return Find([](const Fact& f) { return IsModel(f, submap_model_t::FINAL); }); },
        "the final model");
  EXPECT_EQ(States(8).size(), 1u) << "the other submap's";
}

TEST_F(MapperServiceTest, WhenAFinishIsCutItWritesTheModelAndTriesWhatIsLeftAfterwards) {
  Give(8);
  Await([&] { return Registered().size() == 8; }, "all photos registered");
  CommitFinish(finish_t::REQUESTED);
  CommitFinish(finish_t::CUT);
  Match(9, 9);
  CommitFinish(finish_t::DRAINED);
  CommitFinish(finish_t::SETTLED);
  const auto is_final = [](const Fact& f) { return IsModel(f, submap_model_t::FINAL); };
  Await([&] { return Find(is_final); }, "the final model");
  EXPECT_EQ(std::get<submap_model_t>(*Find(is_final)).num_images, 8);
  EXPECT_TRUE(States(9).empty());
  CommitFinish(finish_t::DONE);
  Await([&] { return IsRegistered(9); }, "the photo registered");
}

TEST_F(MapperServiceTest, WhenAFinishIsCutAMergeThatHasNotBegunIsUndone) {
  Give(8);
  Await([&] { return Registered().size() == 8; }, "all photos registered");
  CommitFinish(finish_t::REQUESTED);
  Order(2, kSubmap);
  CommitFinish(finish_t::CUT);
  const auto is_undone = [](const Fact& f) { return IsMerge(f, merge_t::UNDONE); };
  Await([&] { return Find(is_undone); }, "UNDONE");
  EXPECT_EQ(std::get<merge_t>(*Find(is_undone)).reason, "the time of the finish was up");
  CommitFinish(finish_t::DRAINED);
  CommitFinish(finish_t::SETTLED);
  Await([&] { return Find([](const Fact& f) { return IsModel(f, submap_model_t::FINAL); }); },
        "the final model");
}

TEST_F(MapperServiceTest, TakesBackAPhotoThatTheLedgerRefusesAndGoesOn) {
  RefuseFirst(1, submit_reply_t::REFUSED, "pose is not finite or not a rotation",
              [](const Fact& fact) { return IsRegistration(fact, 5); });
  Give(6);
  Await([&] { return !States(5).empty(); }, "word of the photo");
  EXPECT_EQ(States(5).front(), +registration_t::WITHDRAWN);
  const Fact* told = Find([](const Fact& fact) {
    return std::holds_alternative<registration_t>(fact) &&
           std::get<registration_t>(fact).image_id == 5;
  });
  EXPECT_EQ(std::get<registration_t>(*told).reason,
            "refused by the ledger: pose is not finite or not a rotation");
  // New evidence, and the photo is in.
  Match(7, 13);
  Await([&] { return Registered().size() == 13; }, "all photos registered");
  EXPECT_TRUE(holds_submap_);
}

TEST_F(MapperServiceTest, RejectsAPhotoThatTheLedgerAlwaysRefuses) {
  RefuseFirst(1000, submit_reply_t::REFUSED, "no",
              [](const Fact& fact) { return IsRegistration(fact, 5); });
  Give(13);
  CommitFinish(finish_t::DRAINED);
  CommitFinish(finish_t::SETTLED);
  Await([&] { return Find([](const Fact& f) { return IsModel(f, submap_model_t::FINAL); }); },
        "FINAL");
  EXPECT_EQ(Registered().size(), 12u);
  EXPECT_FALSE(States(5).empty());
  EXPECT_FALSE(IsRegistered(5));
  const auto& model = std::get<submap_model_t>(
      *Find([](const Fact& f) { return IsModel(f, submap_model_t::FINAL); }));
  EXPECT_EQ(model.num_images, 12);
}

TEST_F(MapperServiceTest, DissolvesASubmapWhoseFirstPairIsRefused) {
  RefuseFirst(1, submit_reply_t::REFUSED, "no",
              [](const Fact& fact) { return IsRegistration(fact, 1); });
  Give(3);
  Await([&] { return Find([](const Fact& f) { return IsEnd(f); }); }, "ENDED");
  Await([&] { return !holds_submap_; }, "the submap given back");
}

TEST_F(MapperServiceTest, EndsWhenTheSubmapIsAnothers) {
  RefuseFirst(1000, submit_reply_t::NOT_LEASED, "epoch 1 is over",
              [](const Fact& fact) { return IsRegistration(fact, 5) || IsRegistration(fact, 6); });
  Give(6);
  Await([&] { return holds_submap_; }, "the submap held");
  Await([&] { return !holds_submap_; }, "the submap given back");
  EXPECT_TRUE(States(5).empty());
}

TEST_F(MapperServiceTest, EndsWhenTheLedgerTellsOfANewerEpoch) {
  Give(6);
  Await([&] { return Registered().size() == 6; }, "all photos registered");
  CommitLease("mapper-2", 2);
  Await([&] { return !holds_submap_; }, "the submap given back");
}

TEST_F(MapperServiceTest, SubmitsRefusedModelsAgain) {
  int num_refused = 0;
  std::map<int8_t, int> left{{submap_model_t::CHECKPOINT, 2}, {submap_model_t::FINAL, 2}};
  ingest_.Refuse([&](const Fact& fact) -> std::optional<Refusal> {
    const auto* submap = std::get_if<submap_model_t>(&fact);
    if (submap == nullptr || left[submap->kind] == 0) return std::nullopt;
    --left[submap->kind];
    ++num_refused;
    return Refusal{submit_reply_t::REFUSED, "no"};
  });
  Give(6);
  const auto committed = [&](int8_t state) {
    return Find([state](const Fact& fact) { return IsModel(fact, state); }) != nullptr;
  };
  Await([&] { return committed(submap_model_t::CHECKPOINT); }, "a checkpoint");
  CommitFinish(finish_t::DRAINED);
  CommitFinish(finish_t::SETTLED);
  Await([&] { return committed(submap_model_t::FINAL); }, "the final model");
  EXPECT_EQ(num_refused, 4);
  EXPECT_TRUE(holds_submap_);
}

// As after a restart of the whole session.
TEST_F(MapperServiceTest, WritesAFinalModelInAnEpochThatHasModelsAlready) {
  const std::string model_blob = MakeModel(1, 6);
  for (int n = 1; n <= 5; ++n) CommitCheckpoint(model_blob, n);
  Give(6);
  CommitFinish(finish_t::DRAINED);
  CommitFinish(finish_t::SETTLED);
  Await([&] { return Find([](const Fact& f) { return IsModel(f, submap_model_t::FINAL); }); },
        "FINAL");
}

// Its lease is of the epoch in which the process before it worked, and stands before the model.
TEST_F(MapperServiceTest, GoesOnFromTheLatestModelThoughItIsGrantedTheSubmapBeforeItHasTheLedger) {
  Match(1, 3);
  Seed(1, 3);
  CommitLease("mapper-2", 1);
  CommitCheckpoint(MakeModel(1, 6), 1);
  DeliverCommitted();
  Node node(TestOptions("mapper-2"), loop_, bus_);
  MapperService service(node, RunOptions());
  Grant("mapper-2");
  // With the seed alone it would have photos 1 to 3.
  Await([&] { return Registered().size() == 6; }, "all photos of the model");
}

// As after a restart: another process has placed photo 5, this one has yet to do so.
TEST_F(MapperServiceTest, ComparesNoPhotosBeforeTheMapHoldsWhatTheLedgerSaysOfThem) {
  Give(3);
  Await([&] { return Registered().size() == 3; }, "the first photos registered");
  CommitRegistration(5, kSubmap);
  Ask({5});
  Match(4, 8);
  Await([&] { return IsRegistered(8); }, "the photos after it registered");
  EXPECT_EQ(num_answers_, 0);
  Ask({5});
  Await([&] { return num_answers_ == 1; }, "the answer");
}

// Guests take longer than the merger waits before it asks again.
TEST_F(MapperServiceTest, ARequestThatComesAgainWhileItIsAnsweredIsAnsweredOnce) {
  Give(3);
  Await([&] { return Registered().size() == 3; }, "the first photos registered");
  for (int i = 0; i < 3; ++i) Ask({1, 2});
  Await([&] { return num_answers_ == 1; }, "the answer");
  Match(4, 8);
  Await([&] { return IsRegistered(8); }, "the photos after it registered");
  EXPECT_EQ(num_answers_, 1);
  Ask({1, 2});
  Await([&] { return num_answers_ == 2; }, "the answer to a request that comes later");
}

TEST_F(MapperServiceTest, ComparesNoPhotoThatIsNotThroughMatching) {
  Give(3);
  Await([&] { return Registered().size() == 3; }, "the first photos registered");
  Ask({4});
  Match(4, 8);
  Await([&] { return IsRegistered(8); }, "the photos after it registered");
  EXPECT_EQ(num_answers_, 0);
}

TEST_F(MapperServiceTest, SourceFreezesAgainWhenRefusedAndGoesOnWhenUndone) {
  RefuseFirst(1, submit_reply_t::REFUSED, "no such merge",
              [](const Fact& fact) { return IsMerge(fact, merge_t::FROZEN); });
  Give(6);
  Await([&] { return Registered().size() == 6; }, "all photos registered");
  merge_t merge = Order(kSubmap, 2);
  Await([&] { return Find([](const Fact& f) { return IsMerge(f, merge_t::FROZEN); }); }, "FROZEN");
  merge.header.fact_id = "merge/end";
  merge.state = merge_t::UNDONE;
  ingest_.Commit(merge);
  Match(7, 7);
  Await([&] { return IsRegistered(7); }, "a photo registered after the merge");
}

TEST_F(MapperServiceTest, TargetAbsorbsAModel) {
  FreezeForATargetOfEight(5, 12);
  Await([&] { return Find([](const Fact& f) { return IsMerge(f, merge_t::DONE); }); }, "DONE");
  EXPECT_EQ(Registered().size(), 12u);
}

TEST_F(MapperServiceTest, AMergeReportsEachPhotoThatCameWithItOnce) {
  FreezeForATargetOfEight(5, 12);
  Await([&] { return Find([](const Fact& f) { return IsMerge(f, merge_t::DONE); }); }, "DONE");
  for (int64_t id = 1; id <= 12; ++id) {
    EXPECT_EQ(States(id), std::vector<int>{registration_t::REGISTERED}) << id;
  }
}

TEST_F(MapperServiceTest, TargetSaysWhyItDoesNotAbsorbAModelAndStaysAsItWas) {
  FreezeForATargetOfEight(10, 13);
  Await([&] { return Find([](const Fact& f) { return IsMerge(f, merge_t::UNDONE); }); }, "UNDONE");
  const auto& undone =
      std::get<merge_t>(*Find([](const Fact& f) { return IsMerge(f, merge_t::UNDONE); }));
  EXPECT_EQ(undone.reason, "the poses of only 0 shared images agree");
  for (int64_t id = 1; id <= 8; ++id) {
    EXPECT_EQ(States(id), std::vector<int>{registration_t::REGISTERED}) << id;
  }
  EXPECT_TRUE(States(10).empty());
  Match(9, 9);
  Await([&] { return IsRegistered(9); }, "a photo registered after the merge");
}

TEST_F(MapperServiceTest, TargetBecomesWhatItWasWhenTheMergesEndIsRefused) {
  RefuseFirst(1, submit_reply_t::REFUSED, "merge is over",
              [](const Fact& fact) { return IsMerge(fact, merge_t::DONE); });
  FreezeForATargetOfEight(5, 12);
  Await([&] { return Find([](const Fact& f) { return IsMerge(f, merge_t::UNDONE); }); }, "UNDONE");
  EXPECT_FALSE(Find([](const Fact& f) { return IsMerge(f, merge_t::DONE); }));
  Match(13, 13);
  Await([&] { return IsRegistered(13); }, "a photo registered after the merge");
  for (int64_t id = 1; id <= 8; ++id) EXPECT_TRUE(IsRegistered(id)) << id;
  for (int64_t id = 9; id <= 12; ++id) {
    EXPECT_EQ(States(id),
              (std::vector<int>{registration_t::REGISTERED, registration_t::WITHDRAWN}));
  }
  EXPECT_TRUE(holds_submap_);
}

class SharedMapperTest : public MapperServiceTest {
 protected:
  SharedMapperTest() : MapperServiceTest(ManyHomes(), SharesAtOnce()) {}

  void TellDemand(int num_waiting) {
    demand_t demand{};
    demand.author = "merger";
    demand.kind = "submap";
    demand.num_waiting = num_waiting;
    ingest_node_.Publish(kDemandChannel, demand);
  }

  // Gives the mapper one submap more.
  void GiveOneMore(int64_t submap_id, int64_t image_id1, int64_t image_id2) {
    TellDemand(1);
    Await([&] { return capacity_ > 0; }, "room for another submap");
    TellDemand(0);
    Seed(image_id1, image_id2, submap_id);
    CommitLease(kMapper, 1, submap_id);
    Grant(kMapper, submap_id);
    Await([&] { return capacity_ == 0; }, "the submap taken");
  }

  void GiveThree() {
    Give(8);
    Await([&] { return Registered(kSubmap).size() == 8; }, "the first submap's photos");
    GiveOneMore(2, 3, 5);
    GiveOneMore(3, 4, 6);
    for (const int64_t submap_id : {2, 3}) {
      Await([&] { return Registered(submap_id).size() == 8; }, "the other submaps' photos");
    }
  }
};

TEST_F(SharedMapperTest, SubmapsOfOneMapperGrowInTurn) {
  GiveThree();
  Match(9, 13);
  for (const int64_t submap_id : {1, 2, 3}) {
    Await([&] { return Registered(submap_id).size() == 13; }, "all photos in every submap");
  }
}

TEST_F(SharedMapperTest, TakesNoFurtherSubmapUnlessOneWaits) {
  Give(3);
  Await([&] { return Registered().size() == 3; }, "all photos registered");
  EXPECT_FALSE(loop_.RunUntil([&] { return capacity_ > 0; }, 0.5));
}

TEST_F(SharedMapperTest, TheEndOfOneSubmapLeavesTheOthers) {
  GiveThree();
  ingest_.Commit(MakeSubmapEnd(2, 1, "no more"));
  CommitLease("mapper-2", 2, 3);
  Match(9, 13);
  Await([&] { return Registered(kSubmap).size() == 13; }, "all photos in the first");
  EXPECT_EQ(Registered(2).size(), 8u);
  EXPECT_EQ(Registered(3).size(), 8u);
  EXPECT_TRUE(holds_submap_);
}

TEST_F(SharedMapperTest, EachSubmapOfAMapperGetsItsFinalModel) {
  GiveThree();
  CommitFinish(finish_t::DRAINED);
  CommitFinish(finish_t::SETTLED);
  for (const int64_t submap_id : {1, 2, 3}) {
    const auto is_final = [&](const Fact& fact) {
      return IsModel(fact, submap_model_t::FINAL) &&
             std::get<submap_model_t>(fact).submap_id == submap_id;
    };
    Await([&] { return Find(is_final); }, "a final model");
  }
}

TEST_F(SharedMapperTest, MergesTwoOfItsOwnSubmaps) {
  // Ingest holds the blobs of a fact before it commits it.
  ingest_.Refuse([this](const Fact& fact) -> std::optional<Refusal> {
    if (IsMerge(fact, merge_t::FROZEN)) {
      const auto blob = node_.blobs().GetLocal(std::get<merge_t>(fact).model_blob);
      if (blob.ok()) ingest_node_.blobs().Offer(*blob);
    }
    return std::nullopt;
  });
  GiveThree();
  for (const int64_t submap_id : {1, 2}) Ask({3, 4, 5}, submap_id);
  Await([&] { return num_answers_ == 2; }, "both submaps' poses and points");
  Order(2, kSubmap);
  Await([&] { return Find([](const Fact& f) { return IsMerge(f, merge_t::DONE); }); }, "DONE");
  ingest_.Commit(MakeSubmapEnd(2, 1, "merged", kSubmap));
  Match(9, 13);
  for (const int64_t submap_id : {1, 3}) {
    Await([&] { return Registered(submap_id).size() == 13; }, "the photos that came later");
  }
  EXPECT_EQ(Registered(2).size(), 8u);
}

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

}  // namespace
}  // namespace skein
