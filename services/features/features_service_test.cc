// The whole service on an in-process bus, against an ingest that keeps its ledger in memory.
#include "features/features_service.h"

#include <gtest/gtest.h>

#include <atomic>
#include <optional>
#include <set>
#include <stdexcept>

#include "testing/test_decoder.h"
#include "testing/test_node.h"
#include "testing/test_photos.h"

namespace skein::features_service_test {

constexpr double kDeadlineS = 60;
constexpr char kWorker[] = "features-1";

class OneVectorForAll : public GlobalDescriptorModel {
 public:
  const std::string& id() const override { return id_; }
  int dim() const override { return 2; }
  std::vector<float> Describe(const DescribedPhoto&) override {
    if (throws) throw std::runtime_error("no descriptor");
    return {1, 0};
  }

  std::atomic<bool> throws{false};

 private:
  const std::string id_ = "test-1";
};

class FeaturesServiceTest : public testing::Test {
 protected:
  explicit FeaturesServiceTest(const DecoderOptions& decoder = DecoderOptions())
      : service_(node_, SiftOptions(), 1, model_, *PhotoDecoder::Start(decoder)) {
    bus_.Subscribe<work_request_t>(kWorkRequestChannel, [this](const work_request_t& request) {
      held_ = std::set<int64_t>(request.held.begin(), request.held.end());
      capacity_ = request.capacity;
    });
    bus_.Subscribe<work_failed_t>(kWorkFailedChannel,
                                  [this](const work_failed_t& failed) { failed_ = failed; });
  }

  void AddPhoto(int64_t image_id, const Bytes& photo, int width_px, int height_px) {
    image_t image{};
    image.header.fact_id = "image/" + std::to_string(image_id);
    image.image_id = image_id;
    image.width_px = width_px;
    image.height_px = height_px;
    image.orientation = 1;
    image.blob_id = ingest_node_.blobs().Offer(photo);
    ingest_.Commit(image);
  }
  void Give(int64_t image_id) {
    work_t work{};
    work.worker = kWorker;
    work.kind = "features";
    work.item_id = image_id;
    work.lease_s = 5;
    ingest_node_.Publish(kWorkChannel, work);
  }
  const features_t* Features(int64_t image_id) const {
    for (const Fact& fact : ingest_.facts()) {
      const auto* features = std::get_if<features_t>(&fact);
      if (features != nullptr && features->image_id == image_id) return features;
    }
    return nullptr;
  }
  void Await(const std::function<bool()>& condition, const std::string& what) {
    ASSERT_TRUE(loop_.RunUntil(condition, kDeadlineS)) << "never happened: " << what;
  }
  bool IsFree() const { return held_.empty() && capacity_ == 3; }

  PollLoop loop_;
  Bus bus_{"memq://", loop_};
  Node ingest_node_{TestOptions("ingest"), loop_, bus_};
  Node node_{TestOptions(kWorker), loop_, bus_};
  MemoryIngest ingest_{ingest_node_};
  const std::shared_ptr<OneVectorForAll> model_ = std::make_shared<OneVectorForAll>();
  FeaturesService service_;
  std::set<int64_t> held_;
  int capacity_ = 0;
  std::optional<work_failed_t> failed_;
};

TEST_F(FeaturesServiceTest, DescribesAPhotoAndOffersTheResult) {
  AddPhoto(7, SmallJpeg(1, 320, 240), 320, 240);
  Give(7);
  Await([&] { return Features(7) != nullptr; }, "the features");
  const features_t features = *Features(7);
  EXPECT_EQ(features.header.fact_id, "features/7");
  EXPECT_EQ(features.header.author, kWorker);
  EXPECT_EQ(features.header.computed_at_seq, 1);
  EXPECT_EQ(features.global_model, "test-1");
  EXPECT_GT(features.num_keypoints, 0);
  Await([&] { return IsFree(); }, "the item given back");
}

TEST_F(FeaturesServiceTest, ServesItsBlobsUntilTheyAreCommitted) {
  ingest_.Refuse([](const Fact& fact) -> std::optional<RefusedFact> {
    // Never decided: as long as ingest pulls.
    if (std::holds_alternative<features_t>(fact)) return RefusedFact{submit_reply_t::PULLING, ""};
    return std::nullopt;
  });
  std::optional<features_t> submitted;
  bus_.Subscribe<features_t>(kSubmitFeaturesChannel,
                             [&](const features_t& features) { submitted = features; });
  AddPhoto(7, SmallJpeg(1, 320, 240), 320, 240);
  Give(7);
  Await([&] { return submitted.has_value(); }, "the submission");
  std::optional<Result<Bytes>> keypoints, global;
  ingest_node_.blobs().Fetch(submitted->keypoints_blob, kWorker,
                             [&](const Result<Bytes>& bytes) { keypoints = bytes; });
  ingest_node_.blobs().Fetch(submitted->global_blob, kWorker,
                             [&](const Result<Bytes>& bytes) { global = bytes; });
  Await([&] { return keypoints && global; }, "both blobs");
  EXPECT_EQ(static_cast<int>(DecodeKeypoints(**keypoints)->size()), submitted->num_keypoints);
  EXPECT_EQ(DecodeGlobalDescriptor(**global)->values, (std::vector<float>{1, 0}));
}

TEST_F(FeaturesServiceTest, StartsWhenTheFactComesAfterTheWork) {
  Give(7);
  Await([&] { return held_.count(7) > 0; }, "the item held");
  EXPECT_EQ(Features(7), nullptr);
  AddPhoto(7, SmallJpeg(), 96, 80);
  Await([&] { return Features(7) != nullptr; }, "the features");
}

TEST_F(FeaturesServiceTest, SaysWhatCannotBeDescribedAndGoesOn) {
  AddPhoto(1, {1, 2, 3}, 96, 80);
  Give(1);
  Await([&] { return failed_.has_value(); }, "the failure");
  EXPECT_EQ(failed_->item_id, 1);
  EXPECT_EQ(failed_->kind, "features");
  EXPECT_TRUE(failed_->permanent);
  EXPECT_NE(failed_->reason, "");
  AddPhoto(2, SmallJpeg(), 96, 80);
  Give(2);
  Await([&] { return Features(2) != nullptr; }, "the features of the next");
}

// Ingest counts such failures and parks the photo after a few.
TEST_F(FeaturesServiceTest, AnExceptionFailsThePhotoForNow) {
  model_->throws = true;
  AddPhoto(1, SmallJpeg(), 96, 80);
  Give(1);
  Await([&] { return failed_.has_value(); }, "the failure");
  EXPECT_EQ(failed_->item_id, 1);
  EXPECT_EQ(failed_->reason, "no descriptor");
  EXPECT_FALSE(failed_->permanent);
  model_->throws = false;
  Give(1);
  Await([&] { return Features(1) != nullptr; }, "the features at another try");
}

class CrashingDecoder {
 protected:
  FaultyDecoder faulty_{"crash"};
};
class FeaturesWithoutDecoderTest : private CrashingDecoder, public FeaturesServiceTest {
 protected:
  FeaturesWithoutDecoderTest() : FeaturesServiceTest(faulty_.options) {}
};

TEST_F(FeaturesWithoutDecoderTest, ACrashOfTheDecoderFailsThePhoto) {
  for (const int64_t image_id : {1, 2}) {
    failed_.reset();
    AddPhoto(image_id, SmallJpeg(image_id), 96, 80);
    Give(image_id);
    Await([&] { return failed_.has_value(); }, "the failure");
    EXPECT_EQ(failed_->item_id, image_id);
    EXPECT_EQ(failed_->reason, "the decoder ended by SIGSEGV");
    EXPECT_TRUE(failed_->permanent);
  }
}

TEST_F(FeaturesServiceTest, TellsThatARefusedResultIsForGood) {
  ingest_.Refuse([](const Fact& fact) -> std::optional<RefusedFact> {
    if (!std::holds_alternative<features_t>(fact)) return std::nullopt;
    return RefusedFact{submit_reply_t::REFUSED, "bad keypoint count"};
  });
  AddPhoto(1, SmallJpeg(), 96, 80);
  Give(1);
  Await([&] { return failed_.has_value(); }, "the failure");
  EXPECT_EQ(failed_->reason, "bad keypoint count");
  EXPECT_TRUE(failed_->permanent);
}

TEST_F(FeaturesServiceTest, GivesBackWorkThatIsDoneAlready) {
  AddPhoto(7, SmallJpeg(), 96, 80);
  features_t features{};
  features.header.fact_id = "features/7";
  features.image_id = 7;
  const int64_t seq = ingest_.Commit(features);
  int64_t processed = 0;
  bus_.Subscribe<heartbeat_t>(kHeartbeatChannel, [&](const heartbeat_t& heartbeat) {
    if (heartbeat.instance == kWorker) processed = heartbeat.ledger_seq;
  });
  Await([&] { return processed >= seq; }, "the ledger read");
  for (int i = 0; i < 5; ++i) Give(7);
  AddPhoto(8, SmallJpeg(2), 96, 80);
  Give(8);
  Await([&] { return Features(8) != nullptr; }, "the features of another");
  Await([&] { return IsFree(); }, "all items given back");
}

}  // namespace skein::features_service_test
