#include "shapes/shape_follower.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "testing/test_node.h"

namespace skein::shape_follower_test {

constexpr char kMapper[] = "mapper-1";
constexpr int64_t kSubmap = 3;
constexpr double kDeadlineS = 20;

// A follower, and a mapper that tells shapes as the test says.
class ShapeFollowerTest : public testing::Test {
 protected:
  ShapeFollowerTest() {
    bus_.Subscribe(kShapeWantedChannel, [this](const shape_wanted_t&) { ++num_wanted_; });
    seed_t seed{};
    seed.submap_id = kSubmap;
    Apply(seed);
    Lease(1, kMapper);
  }

  template <class T>
  void Apply(T fact) {
    fact.header.seq = state_.head() + 1;
    fact.header.utime_us = fact.header.seq;
    fact.header.fact_id = std::to_string(fact.header.seq);
    state_.Apply(Fact(fact));
  }
  void Lease(int64_t epoch, const std::string& owner) {
    submap_lease_t lease{};
    lease.submap_id = kSubmap;
    lease.epoch = epoch;
    lease.owner = owner;
    Apply(lease);
  }

  static Bytes Points(uint32_t count, uint64_t version) {
    ShapeChunk chunk;
    chunk.step = 1;
    chunk.version = version;
    chunk.points.resize(count);
    return EncodeShapeChunk(chunk);
  }
  // The mapper serves a shape of chunks {id, version}, ten points each, and tells it.
  submap_shape_t Make(uint64_t version, const std::vector<std::pair<uint64_t, uint64_t>>& chunks) {
    ShapeManifest manifest;
    manifest.version = version;
    for (const auto& [id, chunk_version] : chunks) {
      manifest.chunks.push_back(
          {id, chunk_version, 10, mapper_.blobs().Serve(Points(10, chunk_version)), "tracks", 5});
    }
    return Told(manifest);
  }
  submap_shape_t Told(const ShapeManifest& manifest) {
    const Bytes bytes = EncodeShapeManifest(manifest);
    submap_shape_t told{};
    told.submap_id = kSubmap;
    told.epoch = 1;
    told.owner = kMapper;
    told.version = static_cast<int64_t>(manifest.version);
    told.manifest_bytes = static_cast<int64_t>(bytes.size());
    told.manifest_blob = mapper_.blobs().Serve(bytes);
    return told;
  }
  void Tell(const submap_shape_t& told) { mapper_.Publish(kSubmapShapeChannel, told); }
  ShapeFollowerOptions Options() {
    ShapeFollowerOptions options;
    options.read_session = [this](const std::function<void(const SessionState&)>& read) {
      read(state_);
    };
    options.is_wanted = [this] { return num_viewers_ > 0; };
    options.on_shape = [this](int64_t, uint64_t version) { told_.push_back(version); };
    options.on_model = options.on_shape;
    return options;
  }
  uint64_t Version() const {
    const ShapePtr shape = store_.Find(kSubmap);
    return shape == nullptr ? 0 : shape->version;
  }
  bool WaitFor(const std::function<bool()>& done) { return loop_.RunUntil(done, kDeadlineS); }

  double skipped_s_ = 0;
  PollLoop loop_{[this] { return MonotonicS() + skipped_s_; }};
  Bus bus_{"memq://", loop_};
  Node node_{TestOptions("web"), loop_, bus_};
  Node mapper_{TestOptions(kMapper), loop_, bus_};
  SessionState state_;
  ShapeStore store_;
  int num_wanted_ = 0, num_viewers_ = 0;
  std::vector<uint64_t> told_;
  ShapeFollower follower_{node_, store_, Options()};
};

TEST_F(ShapeFollowerTest, AsksForShapesWhileSomebodyLooks) {
  EXPECT_FALSE(loop_.RunUntil([&] { return num_wanted_ > 0; }, 1.5));
  num_viewers_ = 1;
  EXPECT_TRUE(WaitFor([&] { return num_wanted_ > 0; }));
  num_viewers_ = 0;
  loop_.RunUntil([] { return false; }, 1.2);
  const int before = num_wanted_;
  EXPECT_FALSE(loop_.RunUntil([&] { return num_wanted_ > before; }, 1.5));
  follower_.NoteLook();
  EXPECT_TRUE(WaitFor([&] { return num_wanted_ > before; })) << "a request without a page";
}

TEST_F(ShapeFollowerTest, PullsWhatIsNew) {
  Tell(Make(10, {{1, 10}, {2, 10}}));
  ASSERT_TRUE(WaitFor([&] { return Version() == 10; }));
  const ShapePtr first = store_.Find(kSubmap);
  ASSERT_EQ(first->chunks.size(), 2u);
  EXPECT_EQ(*first->chunks[0].points, Points(10, 10));
  EXPECT_EQ(first->owner, kMapper);
  Tell(Make(20, {{2, 10}, {3, 20}}));
  ASSERT_TRUE(WaitFor([&] { return Version() == 20; }));
  const ShapePtr second = store_.Find(kSubmap);
  EXPECT_EQ(second->Find(1), nullptr);
  EXPECT_EQ(second->Find(2)->points, first->Find(2)->points) << "the same bytes, not pulled again";
  EXPECT_EQ(told_, (std::vector<uint64_t>{10, 20}));
}

TEST_F(ShapeFollowerTest, PullsWhoSeesThePointsWhereThatIsWanted) {
  ShapeStore store;
  std::vector<uint64_t> told;
  ShapeFollowerOptions options = Options();
  options.with_tracks = true;
  options.on_shape = [&told](int64_t, uint64_t version) { told.push_back(version); };
  const ShapeFollower with_tracks(node_, store, options);
  PointTracks tracks;
  for (uint32_t i = 0; i < 10; ++i) {
    tracks.ends.push_back(2 * (i + 1));
    tracks.observations.insert(tracks.observations.end(), {{1, i}, {2, i}});
  }
  const Bytes bytes = EncodePointTracks(tracks);
  ShapeManifest manifest;
  manifest.version = 10;
  manifest.chunks = {{1, 10, 10, mapper_.blobs().Serve(Points(10, 10)),
                      mapper_.blobs().Serve(bytes), bytes.size()}};
  Tell(Told(manifest));
  ASSERT_TRUE(WaitFor([&] { return told.size() == 1; }));
  ASSERT_NE(store.Find(kSubmap)->chunks[0].tracks, nullptr);
  EXPECT_EQ(*store.Find(kSubmap)->chunks[0].tracks, bytes);
  tracks.ends.pop_back();  // of nine points
  const Bytes fewer = EncodePointTracks(tracks);
  manifest.version = 20;
  manifest.chunks.push_back({2, 20, 10, mapper_.blobs().Serve(Points(10, 20)),
                             mapper_.blobs().Serve(fewer), fewer.size()});
  Tell(Told(manifest));
  EXPECT_FALSE(loop_.RunUntil([&] { return told.size() == 2; }, 1.5));
  manifest.version = 30;
  manifest.chunks.pop_back();
  Tell(Told(manifest));
  ASSERT_TRUE(WaitFor([&] { return told.size() == 2; }));
  EXPECT_EQ(store.Find(kSubmap)->version, 30u);
}

TEST_F(ShapeFollowerTest, ABlobThatIsGoneEndsAPullAndTheNextShapeComes) {
  submap_shape_t gone = Make(10, {{1, 10}});
  gone.manifest_blob = std::string(64, 'a');
  Tell(gone);
  Tell(Make(20, {{1, 20}}));
  ASSERT_TRUE(WaitFor([&] { return Version() == 20; }));
  EXPECT_EQ(told_, std::vector<uint64_t>{20});
}

TEST_F(ShapeFollowerTest, AMapperThatDiesWithItsShapeHoldsUpNobody) {
  submap_shape_t told = Make(10, {{1, 10}});
  Lease(2, "mapper-9");  // nobody of that name answers
  told.epoch = 2;
  told.owner = "mapper-9";
  told.manifest_blob = std::string(64, 'b');
  Tell(told);
  loop_.RunUntil([] { return false; }, 0.5);
  Lease(3, kMapper);
  told = Make(20, {{1, 20}});
  told.epoch = 3;
  Tell(told);
  EXPECT_FALSE(loop_.RunUntil([&] { return !told_.empty(); }, 1.5));
  skipped_s_ += 11;
  EXPECT_TRUE(WaitFor([&] { return Version() == 20; }));
}

TEST_F(ShapeFollowerTest, OnlyWhoHasTheLeaseIsHeard) {
  submap_shape_t told = Make(10, {{1, 10}});
  told.epoch = 2;
  Tell(told);
  told.epoch = 1;
  told.owner = "mapper-2";
  Tell(told);
  told.owner = kMapper;
  told.submap_id = 99;
  Tell(told);
  EXPECT_FALSE(loop_.RunUntil([&] { return !told_.empty(); }, 0.5));
  Lease(2, kMapper);
  Tell(Make(11, {{1, 10}}));
  EXPECT_FALSE(loop_.RunUntil([&] { return !told_.empty(); }, 0.5)) << "of the epoch before";
}

TEST_F(ShapeFollowerTest, ShapesThatDoNotFitTogetherAreLeftOut) {
  ShapeManifest manifest;
  manifest.version = 10;
  manifest.chunks = {{1, 10, 11, mapper_.blobs().Serve(Points(10, 10)), "", 0}};
  Tell(Told(manifest));
  manifest.version = 11;
  manifest.chunks = {{1, 10, ShapeChunk::kMaxPoints + 1, "x", "", 0}};
  Tell(Told(manifest));
  submap_shape_t told = Make(12, {{1, 10}});
  told.manifest_blob = mapper_.blobs().Serve(Bytes(100, 7));
  told.manifest_bytes = 100;
  Tell(told);
  EXPECT_FALSE(loop_.RunUntil([&] { return !told_.empty(); }, 1.5));
  skipped_s_ += 11;  // nothing comes of the first
  Tell(Make(20, {{1, 20}}));
  EXPECT_TRUE(WaitFor([&] { return Version() == 20; })) << "it goes on";
}

TEST_F(ShapeFollowerTest, ASilentMappersMapIsShownByItsModel) {
  num_viewers_ = 1;
  EXPECT_FALSE(follower_.MayUseModel(kSubmap)) << "it was not asked yet";
  ASSERT_TRUE(WaitFor([&] { return num_wanted_ > 0; }));
  EXPECT_FALSE(follower_.MayUseModel(kSubmap)) << "it was just asked";
  skipped_s_ += 6;
  EXPECT_TRUE(follower_.MayUseModel(kSubmap));
  Tell(Make(10, {{1, 10}}));
  ASSERT_TRUE(WaitFor([&] { return Version() == 10; }));
  EXPECT_FALSE(follower_.MayUseModel(kSubmap));
  skipped_s_ += 11;
  EXPECT_TRUE(follower_.MayUseModel(kSubmap));
  submap_model_t model{};
  model.submap_id = kSubmap;
  model.model_blob = "model";
  for (int i = 0; i < 30; ++i) Apply(model);  // the last at 32 us, after the shape
  ASSERT_TRUE(WaitFor([&] { return told_.size() == 2; }));
  EXPECT_EQ(told_.back(), 32u);
}

}  // namespace skein::shape_follower_test
