// The whole service on an in-process bus, against an ingest that keeps its ledger in memory and the
// mappers of two submaps played by the test. The submaps are those of a synthetic place.
#include "merger/merger_service.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <new>
#include <ostream>
#include <string>
#include <vector>

#include "map/shared_images.h"
#include "testing/synthetic_submaps.h"
#include "testing/test_node.h"

namespace skein::merger_service_test {

constexpr double kDeadlineS = 30;
constexpr int64_t kSource = 2, kTarget = 1;  // the smaller one is the source

class MergerServiceTest : public testing::Test {
 protected:
  MergerServiceTest() {
    bus_.Subscribe<shared_request_t>(kSharedRequestChannel,
                                     [this](const shared_request_t& r) { Answer(r); });
    Restart();
  }

  void Restart() {
    service_.reset();
    node_.reset();
    node_ = std::make_unique<Node>(TestOptions("merger"), loop_, bus_);
    service_ = std::make_unique<MergerService>(*node_, MergerOptions());
  }

  void Await(const std::function<bool()>& condition, const std::string& what) {
    ASSERT_TRUE(loop_.RunUntil(condition, kDeadlineS)) << "never happened: " << what;
  }

  // As the mapper of that submap.
  void Answer(const shared_request_t& request) {
    shared_reply_t reply{};
    reply.request_id = request.request_id;
    reply.submap_id = request.submap_id;
    reply.epoch = 1;
    reply.owner = "mapper";
    const SharedImages shared =
        SharedImagesOf(request.submap_id == kSource ? source_ : target_, request.image_ids);
    reply.blob_id = mapper_.blobs().Serve(poison_ ? poison_(shared) : EncodeSharedImages(shared));
    mapper_.Publish(kSharedReplyChannel, reply);
  }

  void AddSubmap(int64_t submap_id, int64_t image_id1, int64_t image_id2) {
    seed_t seed{};
    seed.header.fact_id = "seed/" + std::to_string(submap_id);
    seed.submap_id = submap_id;
    seed.image_id1 = image_id1;
    seed.image_id2 = image_id2;
    ingest_.Commit(seed);
    submap_lease_t lease{};
    lease.header.fact_id = "lease/" + std::to_string(submap_id);
    lease.submap_id = submap_id;
    lease.epoch = 1;
    lease.owner = "mapper";
    ingest_.Commit(lease);
  }

  void Register(int64_t submap_id, int64_t first, int64_t last) {
    for (int64_t id = first; id <= last; ++id) {
      registration_t fact{};
      fact.header.fact_id = "registration/" + std::to_string(submap_id) + "/" + std::to_string(id);
      fact.image_id = id;
      fact.submap_id = submap_id;
      fact.epoch = 1;
      fact.state = registration_t::REGISTERED;
      ingest_.Commit(fact);
    }
  }

  // Three shared photos: 10, 11 and 12.
  void AddBothSubmaps() {
    AddSubmap(kTarget, 1, 3);
    AddSubmap(kSource, 15, 17);
    Register(kTarget, 1, 12);
    Register(kSource, 10, 20);
  }

  void Undo(merge_t merge) {
    merge.header = {};
    merge.header.fact_id = "merge/" + std::to_string(merge.merge_id) + "/end";
    merge.state = merge_t::UNDONE;
    merge.reason = "the adjustment made it worse";
    ingest_.Commit(merge);
  }

  // Both mappers have worked up to the ledger's end.
  void TellStatus() {
    for (const int64_t submap_id : {kSource, kTarget}) {
      submap_status_t status{};
      status.submap_id = submap_id;
      status.epoch = 1;
      status.owner = "mapper";
      status.ledger_seq = static_cast<int64_t>(ingest_.facts().size());
      mapper_.Publish(kSubmapStatusChannel, status);
    }
  }
  void CommitDrained() {
    finish_t drained{};
    drained.header.fact_id = "finish/drained";
    drained.finish_id = 1;
    drained.state = finish_t::DRAINED;
    ingest_.Commit(drained);
  }
  void Drain() {
    CommitDrained();
    loop_.AddTimer(0.1, [this] { TellStatus(); });
  }
  bool HasSettled() const {
    const auto* finish = std::get_if<finish_t>(&ingest_.facts().back());
    return finish != nullptr && finish->state == finish_t::SETTLED;
  }

  std::vector<merge_t> Orders() const {
    std::vector<merge_t> orders;
    for (const Fact& fact : ingest_.facts()) {
      const auto* merge = std::get_if<merge_t>(&fact);
      if (merge != nullptr && merge->state == merge_t::ORDERED) orders.push_back(*merge);
    }
    return orders;
  }

  // Both ways round.
  void OrderAndUndoTwice() {
    const size_t before = Orders().size();
    for (size_t i = before + 1; i <= before + 2; ++i) {
      Await([&] { return Orders().size() == i; }, "an order");
      Undo(Orders().back());
    }
  }

  std::function<Bytes(SharedImages)> poison_;  // what mappers answer instead; null: the truth
  const SyntheticWorld world_{WallOptions(), 1};
  const Reconstruction target_ = world_.Submap(1, 14, Similarity(), 1.0);
  const Reconstruction source_ = world_.Submap(
      10, 20, {3.0, Eigen::Quaterniond(1, 0.3, -0.5, 0.2).normalized(), {5, -2, 8}}, 1.0);
  PollLoop loop_;
  Bus bus_{"memq://", loop_};
  Node ingest_node_{TestOptions("ingest"), loop_, bus_};
  Node mapper_{TestOptions("mapper"), loop_, bus_};
  MemoryIngest ingest_{ingest_node_};
  std::unique_ptr<Node> node_;
  std::unique_ptr<MergerService> service_;
};

TEST_F(MergerServiceTest, OrdersTheSmallerIntoTheLargerWithTheirSimilarity) {
  AddBothSubmaps();
  Await([&] { return Orders().size() == 1; }, "an order");
  const merge_t order = Orders().front();
  EXPECT_EQ(order.source_id, kSource);
  EXPECT_EQ(order.target_id, kTarget);
  EXPECT_EQ(order.num_shared_images, 3);
  EXPECT_EQ(order.num_inlier_images, 3);
  EXPECT_NEAR(order.target_from_source_scale, 1 / 3.0, 0.01);
  EXPECT_EQ(order.sim3_options.min_inlier_images, Sim3Options().min_inlier_images);
  EXPECT_EQ(order.sim3_options.min_inlier_ratio, Sim3Options().min_inlier_ratio);
}

TEST_F(MergerServiceTest, AMergeThatWasUndoneIsTriedTheOtherWayRoundAndAgainOnlyWhenFinishing) {
  AddBothSubmaps();
  OrderAndUndoTwice();
  EXPECT_EQ(Orders().back().source_id, kTarget);
  Restart();  // what was tried is in the ledger
  Drain();
  OrderAndUndoTwice();  // of the maps as they are worked over
  Restart();
  Await([&] { return HasSettled(); }, "nothing left to merge");
  EXPECT_EQ(Orders().size(), 4u);
}

// A merge that was chosen before knew nothing of what a map would win or lose.
TEST_F(MergerServiceTest, InAFinishNothingIsMergedBeforeTheMapsAreWorkedOver) {
  AddBothSubmaps();
  CommitDrained();
  EXPECT_FALSE(loop_.RunUntil([&] { return !Orders().empty(); }, 1));
  TellStatus();
  Await([&] { return Orders().size() == 1; }, "an order");
}

TEST_F(MergerServiceTest, HalfAsManyPhotosMoreAreNewEvidence) {
  AddBothSubmaps();
  OrderAndUndoTwice();
  Restart();
  Register(kTarget, 13, 14);
  Await([&] { return Orders().size() == 3; }, "an order");
  EXPECT_EQ(Orders().back().num_shared_images, 5);
}

TEST_F(MergerServiceTest, AnExceptionFailsTheAttemptAndTheNextSucceeds) {
  node_->steps().OnBegin([](const Step& step) {
    if (step.item == kSource) throw std::bad_alloc();
  });
  AddBothSubmaps();
  const merge_t* failed = nullptr;
  Await(
      [&] {
        failed = std::get_if<merge_t>(&ingest_.facts().back());
        return failed != nullptr;
      },
      "an attempt");
  EXPECT_EQ(failed->state, +merge_t::FAILED);
  EXPECT_EQ(failed->reason, std::bad_alloc().what());
  node_->steps().OnBegin(nullptr);
  Register(kTarget, 13, 14);
  Await([&] { return Orders().size() == 1; }, "an order");
}

// Answers of mappers that no similarity can be estimated from.
struct PoisonedAnswer {
  const char* name;
  std::function<Bytes(SharedImages)> change;
};

std::ostream& operator<<(std::ostream& out, const PoisonedAnswer& poison) {
  return out << poison.name;
}

std::function<Bytes(SharedImages)> EachImage(void (*change)(SharedImage*)) {
  return [change](SharedImages images) {
    for (SharedImage& image : images) change(&image);
    return EncodeSharedImages(images);
  };
}

const std::vector<PoisonedAnswer> kPoisonedAnswers = {
    {"DoesNotDecode", [](const SharedImages&) { return Bytes{'r', 'u', 'b', 'b', 'i', 's', 'h'}; }},
    {"IsEmpty", [](const SharedImages&) { return EncodeSharedImages({}); }},
    {"CameraIsUnknown", EachImage([](SharedImage* image) { image->camera_model_id = 99; })},
    {"ParametersAreMissing", EachImage([](SharedImage* image) { image->params.clear(); })},
    {"ParametersAreNotFinite",
     EachImage([](SharedImage* image) { image->params.assign(image->params.size(), NAN); })},
    {"PoseIsNotFinite",
     EachImage([](SharedImage* image) { image->qvec.fill(NAN), image->tvec.fill(NAN); })},
    {"PoseIsZero", EachImage([](SharedImage* image) { image->qvec.fill(0); })},
    {"HasNoPoints", EachImage([](SharedImage* image) { image->points.clear(); })},
    {"PointsAreNotFinite", EachImage([](SharedImage* image) {
       for (SharedPoint& point : image->points) point.xyz.fill(NAN);
     })},
    {"PointsAreOne", EachImage([](SharedImage* image) {
       for (SharedPoint& point : image->points) point.xyz.fill(1);
     })},
};

class PoisonedAnswerTest : public MergerServiceTest,
                           public testing::WithParamInterface<PoisonedAnswer> {};

TEST_P(PoisonedAnswerTest, FailsWithItsReasonAndTheNextAttemptSucceeds) {
  poison_ = GetParam().change;
  AddBothSubmaps();
  const auto failed = [this]() -> const merge_t* {
    const auto* merge = std::get_if<merge_t>(&ingest_.facts().back());
    return merge != nullptr && merge->state == merge_t::FAILED ? merge : nullptr;
  };
  Await([&] { return failed() != nullptr; }, "FAILED");
  EXPECT_NE(failed()->reason, "");
  EXPECT_TRUE(Orders().empty());
  poison_ = nullptr;
  Restart();  // it reads what was tried
  Register(kTarget, 13, 14);
  Await([&] { return Orders().size() == 1; }, "an order");
}

INSTANTIATE_TEST_SUITE_P(Table, PoisonedAnswerTest, testing::ValuesIn(kPoisonedAnswers),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace skein::merger_service_test
