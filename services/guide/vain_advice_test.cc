#include "guide/vain_advice.h"

#include <gtest/gtest.h>

#include "testing/test_ledger.h"

namespace skein::vain_advice_test {

constexpr int64_t kSubmap = 3;

AgentAdvice AdviceOf(const std::string& agent, const std::vector<double>& common_points) {
  AgentAdvice advice;
  advice.agent = agent;
  for (const double common : common_points) {
    advice.stations.emplace_back();
    advice.stations.back().station.common_points = common;
  }
  return advice;
}

class VainAdviceTest : public testing::Test {
 protected:
  VainAdviceTest() { ledger_.Seed(kSubmap, 0, 0); }

  int64_t Take(const std::string& agent) {
    ledger_.PhotoOf(agent, ++num_images_);
    vain_.NotePhoto(agent, num_images_);
    return num_images_;
  }
  int64_t Try(int64_t image_id, int8_t outcome) {
    ledger_.Register(kSubmap, image_id, outcome);
    return vain_.NoteOutcome(ledger_.state(), image_id);
  }
  std::vector<double> CommonPointsOf(const std::string& agent) const {
    std::vector<double> common;
    for (const VainPhoto& photo : vain_.Of(agent, kSubmap)) common.push_back(photo.common_points);
    return common;
  }

  TestLedger ledger_;
  VainAdvice vain_;
  int64_t num_images_ = 0;
};

TEST_F(VainAdviceTest, APhotoThatIsNotRegisteredWasInVainUntilItIs) {
  vain_.NoteAdvice(kSubmap, AdviceOf("alice", {100, 200}));
  const int64_t photo = Take("alice");
  EXPECT_TRUE(CommonPointsOf("alice").empty()) << "nobody has tried it yet";
  EXPECT_EQ(Try(photo, registration_t::DEFERRED), kSubmap);
  EXPECT_EQ(CommonPointsOf("alice"), std::vector<double>{100});
  EXPECT_EQ(Try(photo, registration_t::REJECTED), 0) << "which is known";
  EXPECT_EQ(Try(photo, registration_t::REGISTERED), kSubmap);
  EXPECT_TRUE(CommonPointsOf("alice").empty());
  EXPECT_EQ(Try(photo, registration_t::WITHDRAWN), kSubmap);
  EXPECT_EQ(CommonPointsOf("alice").size(), 1u);
}

TEST_F(VainAdviceTest, PhotosAreOfTheStationsInTheirOrder) {
  vain_.NoteAdvice(kSubmap, AdviceOf("alice", {100, 200}));
  vain_.NoteAdvice(kSubmap, AdviceOf("bob", {300}));
  const int64_t first = Take("alice"), bobs = Take("bob"), second = Take("alice"),
                third = Take("alice");
  EXPECT_EQ(Try(first, registration_t::REGISTERED), 0);
  EXPECT_EQ(Try(second, registration_t::DEFERRED), kSubmap);
  EXPECT_EQ(Try(third, registration_t::DEFERRED), 0) << "no station is left that it could be of";
  EXPECT_EQ(CommonPointsOf("alice"), std::vector<double>{200});
  EXPECT_TRUE(CommonPointsOf("bob").empty());
  Try(bobs, registration_t::DEFERRED);
  EXPECT_EQ(CommonPointsOf("bob"), std::vector<double>{300});
  vain_.NoteAdvice(kSubmap, AdviceOf("alice", {400}));
  Try(Take("alice"), registration_t::DEFERRED);
  EXPECT_EQ(CommonPointsOf("alice"), (std::vector<double>{200, 400}));
}

TEST_F(VainAdviceTest, APhotoThatMatchesNoOtherWasInVain) {
  vain_.NoteAdvice(kSubmap, AdviceOf("alice", {100}));
  const int64_t photo = Take("alice");
  matches_t matches{};
  matches.image_id = photo;
  ledger_.Commit(matches);
  EXPECT_EQ(vain_.NoteOutcome(ledger_.state(), photo), kSubmap);
  EXPECT_EQ(CommonPointsOf("alice").size(), 1u);
}

TEST_F(VainAdviceTest, ABlurredPhotoTellsNothingOfItsStation) {
  vain_.NoteAdvice(kSubmap, AdviceOf("alice", {100, 200}));
  for (const float blur : {0.6F, 0.2F}) {
    const int64_t photo = Take("alice");
    features_t features{};
    features.image_id = photo;
    features.num_keypoints = 4000;
    features.brightness = 0.5F;
    features.coverage = 0.8F;
    features.blur = blur;
    ledger_.Commit(features);
    candidates_t candidates{};
    candidates.image_id = photo;
    ledger_.Commit(candidates);
    matches_t matches{};
    matches.image_id = photo;
    ledger_.Commit(matches);
    EXPECT_EQ(vain_.NoteOutcome(ledger_.state(), photo), blur > 0.5F ? 0 : kSubmap);
  }
  EXPECT_EQ(CommonPointsOf("alice"), std::vector<double>{200});
}

TEST_F(VainAdviceTest, WithoutAdviceNothingIsInVain) {
  const int64_t photo = Take("alice");
  EXPECT_EQ(Try(photo, registration_t::DEFERRED), 0);
  vain_.NoteAdvice(kSubmap, AdviceOf("alice", {100}));
  const int64_t advised = Take("alice");
  Try(advised, registration_t::DEFERRED);
  vain_.Drop(kSubmap);
  EXPECT_TRUE(CommonPointsOf("alice").empty()) << "the submap has ended";
}

}  // namespace skein::vain_advice_test
