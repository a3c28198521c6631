// Each kind of a mapper's jobs throws whenever it is tried: the session goes on without it.
#include <stdexcept>

#include "core/attempt.h"
#include "session/submap_steps.h"
#include "testing/mapper_service_rig.h"

namespace skein::failed_steps_test {

// Without checkpoints each run begins from the seed: the test's ingest keeps no blobs.
SubmapRunOptions WithoutCheckpoints() {
  SubmapRunOptions options = ManyHomes();
  options.checkpoint.period_s = 10'000;
  options.checkpoint.photos = 10'000;
  return options;
}

class FailedStepsTest : public MapperServiceTest {
 protected:
  FailedStepsTest() : MapperServiceTest(WithoutCheckpoints()) {
    bus_.Subscribe<work_failed_t>(kWorkFailedChannel,
                                  [this](const work_failed_t& failed) { OnFailed(failed); });
  }

  // Steps whose name begins so throw.
  void Fail(const std::string& prefix) {
    node_.steps().OnBegin([prefix](const Step& step) {
      if (step.name.rfind(prefix, 0) == 0) throw std::out_of_range("injected into " + step.name);
    });
  }

  // As ingest: counts, and leases the submap again.
  void OnFailed(const work_failed_t& failed) {
    if (failed.epoch != epoch_) return;
    failed_.insert(failed.step);
    failure_t failure{};
    failure.header.fact_id = FailedStepFactId(failed.item_id, failed.step, std::to_string(epoch_));
    failure.stage = failed.kind;
    failure.submap_id = failed.item_id;
    failure.step = failed.step;
    failure.reason = failed.reason;
    failure.attempts = ++attempts_[failed.step];
    failure.parked = failure.attempts >= kMaxFailures;
    ingest_.Commit(failure);
    if (failure.parked && !CanBeLeftOut(failed.step)) {
      ingest_.Commit(MakeSubmapEnd(failed.item_id, epoch_, failed.reason));
      return;
    }
    CommitLease(kMapper, ++epoch_, failed.item_id);
    Grant(kMapper, failed.item_id, epoch_);
  }

  void AwaitFinalModel() {
    CommitFinish(finish_t::DRAINED);
    CommitFinish(finish_t::SETTLED);
    Await([&] { return Find([](const Fact& f) { return IsModel(f, submap_model_t::FINAL); }); },
          "the final model");
  }

  bool WasLeftOut(const std::string& prefix) const {
    return std::any_of(attempts_.begin(), attempts_.end(), [&](const auto& step) {
      return step.first.rfind(prefix, 0) == 0 && step.second >= kMaxFailures;
    });
  }

  int64_t epoch_ = 1;
  std::map<std::string, int> attempts_;
  std::set<std::string> failed_;
};

class SteplessFinish : public FailedStepsTest, public testing::WithParamInterface<const char*> {};

TEST_P(SteplessFinish, HasAllPhotosThatItCanHave) {
  Fail(GetParam());
  WantShapes();
  Give(13);
  const bool is_photo = std::string(GetParam()) == "photo 5";
  Await([&] { return Registered().size() == (is_photo ? 12u : 13u); }, "all photos registered");
  AwaitFinalModel();
  Await([&] { return WasLeftOut(GetParam()); }, "the step left out");
  for (const std::string& step : failed_) EXPECT_EQ(step.rfind(GetParam(), 0), 0u) << step;
  EXPECT_EQ(IsRegistered(5), !is_photo);
  const int expected = is_photo ? registration_t::REJECTED : registration_t::REGISTERED;
  EXPECT_EQ(States(5).back(), expected);
}

INSTANTIATE_TEST_SUITE_P(Steps, SteplessFinish,
                         testing::Values("photo 5", "maintenance", "consolidation",
                                         "final adjustment", "assessment", "shape"));

TEST_F(FailedStepsTest, AModelThatCannotBeAssessedTellsNothingOfItsPlace) {
  Fail("assessment");
  Give(8);
  Await([&] { return Registered().size() == 8; }, "all photos registered");
  AwaitFinalModel();
  const auto& model = std::get<submap_model_t>(
      *Find([](const Fact& f) { return IsModel(f, submap_model_t::FINAL); }));
  EXPECT_EQ(model.num_images, 8);
  EXPECT_EQ(model.place.num_photos, 0);
  EXPECT_EQ(model.georeference.reason, "");
}

TEST_F(FailedStepsTest, AMergeEndsUndoneWithTheReason) {
  Fail("merge");
  FreezeForATargetOfEight(6, 13);
  const auto is_undone = [](const Fact& f) { return IsMerge(f, merge_t::UNDONE); };
  Await([&] { return Find(is_undone) != nullptr; }, "the merge undone");
  EXPECT_NE(std::get<merge_t>(*Find(is_undone)).reason.find("injected"), std::string::npos);
  EXPECT_EQ(attempts_.begin()->second, kMaxFailures);
  AwaitFinalModel();
}

TEST_F(FailedStepsTest, AComparisonIsAnsweredWithNothing) {
  Fail("comparison");
  Give(8);
  Await([&] { return Registered().size() == 8; }, "all photos registered");
  // As the merger, which asks until it is answered.
  const auto timer = loop_.AddTimer(0.2, [this] { Ask({1, 2}); });
  Await([&] { return num_answers_ > 0; }, "an answer");
  loop_.CancelTimer(timer);
  EXPECT_TRUE(WasLeftOut("comparison"));
}

class VitalStep : public FailedStepsTest, public testing::WithParamInterface<const char*> {};

TEST_P(VitalStep, EndsTheSubmap) {
  Fail(GetParam());
  Give(8);
  CommitFinish(finish_t::DRAINED);
  CommitFinish(finish_t::SETTLED);
  Await([&] { return Find(IsEnd) != nullptr; }, "the submap's end");
  EXPECT_EQ(attempts_[GetParam()], kMaxFailures);
}

INSTANTIATE_TEST_SUITE_P(Steps, VitalStep, testing::Values("seed", "trials", "model"));

TEST_F(FailedStepsTest, ACheckpointThatCannotBeRestoredEndsTheSubmap) {
  Match(1, 8);
  Seed(1, 3);
  CommitCheckpoint(MakeModel(1, 8), 1);
  Fail("restoring");
  CommitLease(kMapper, 1);
  Grant(kMapper);
  Await([&] { return Find(IsEnd) != nullptr; }, "the submap's end");
  EXPECT_EQ(attempts_["restoring"], kMaxFailures);
}

}  // namespace skein::failed_steps_test
