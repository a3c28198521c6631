#include "shapes/dense_follower.h"

#include <gtest/gtest.h>

#include "testing/test_node.h"

namespace skein::dense_follower_test {

constexpr char kDense[] = "dense";
constexpr int64_t kSubmap = 3;
constexpr double kDeadlineS = 20;

class DenseFollowerTest : public testing::Test {
 protected:
  dense_points_t Make(uint64_t version, uint32_t num_points) {
    DenseManifest manifest;
    manifest.version = version;
    manifest.photos = {{5, 1, 0.5f, {{80, version, num_points, "ab"}}}};
    return Told(EncodeDenseManifest(manifest), version);
  }
  dense_points_t Told(const Bytes& bytes, uint64_t version) {
    dense_points_t told{};
    told.author = kDense;
    told.submap_id = kSubmap;
    told.version = static_cast<int64_t>(version);
    told.manifest_bytes = static_cast<int64_t>(bytes.size());
    told.manifest_blob = dense_.blobs().Serve(bytes);
    return told;
  }
  void Publish(const dense_points_t& told) { dense_.Publish(kDensePointsChannel, told); }
  bool WaitFor(const std::function<bool()>& done) { return loop_.RunUntil(done, kDeadlineS); }
  uint64_t Version() const {
    const DensePointsPtr points = store_.Find(kSubmap);
    return points == nullptr ? 0 : points->manifest.version;
  }

  PollLoop loop_;
  Bus bus_{"memq://", loop_};
  Node dense_{TestOptions(kDense), loop_, bus_};
  Node web_{TestOptions("web"), loop_, bus_};
  bool is_live_ = true;
  int num_told_ = 0;
  DenseStore store_;
  DenseFollower follower_{web_, store_, [this](int64_t) { return is_live_; },
                          [this](int64_t, const DensePoints&) { ++num_told_; }};
};

TEST_F(DenseFollowerTest, KeepsTheNewest) {
  Publish(Make(10, 7));
  ASSERT_TRUE(WaitFor([&] { return Version() == 10; }));
  EXPECT_EQ(store_.Find(kSubmap)->owner, kDense);
  ASSERT_NE(store_.Find(kSubmap)->Find(80), nullptr);
  EXPECT_EQ(store_.Find(kSubmap)->Find(80)->num_points, 7u);
  EXPECT_EQ(store_.Find(kSubmap)->Find(81), nullptr);
  const uint64_t version = store_.Find(kSubmap)->version;
  Publish(Make(10, 7));
  Publish(Make(11, 8));
  ASSERT_TRUE(WaitFor([&] { return Version() == 11; }));
  EXPECT_EQ(num_told_, 2);
  EXPECT_GT(store_.Find(kSubmap)->version, version);
}

TEST_F(DenseFollowerTest, APublisherWhoseClockWasPutBackIsHeard) {
  Publish(Make(10, 7));
  ASSERT_TRUE(WaitFor([&] { return Version() == 10; }));
  const uint64_t version = store_.Find(kSubmap)->version;
  Publish(Make(4, 7));
  ASSERT_TRUE(WaitFor([&] { return Version() == 4; }));
  EXPECT_GT(store_.Find(kSubmap)->version, version);
}

TEST_F(DenseFollowerTest, AListThatIsDamagedOrOfAnotherVersionIsNotTaken) {
  Publish(Told(Bytes(100, 3), 10));
  dense_points_t other = Make(11, 7);
  other.version = 12;
  Publish(other);
  dense_points_t huge = Make(13, 7);
  huge.manifest_bytes = int64_t{1} << 40;
  Publish(huge);
  dense_points_t absent = Make(14, 7);
  absent.manifest_blob = std::string(64, 'a');
  Publish(absent);
  ASSERT_TRUE(WaitFor([&] {
    Publish(Make(20, 7));
    return Version() == 20;
  }));
  EXPECT_EQ(num_told_, 1);
}

TEST_F(DenseFollowerTest, ASubmapThatEndsMeanwhileGetsNone) {
  Publish(Make(10, 7));
  is_live_ = false;
  EXPECT_FALSE(loop_.RunUntil([&] { return Version() != 0; }, 0.5));
  EXPECT_FALSE(store_.Drop(kSubmap));
  follower_.Drop(kSubmap);
}

}  // namespace skein::dense_follower_test
