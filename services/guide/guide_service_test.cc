#include "guide/guide_service.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <stdexcept>

#include "testing/test_place.h"
#include "testing/test_shape.h"

namespace skein::guide_service_test {

class GuideServiceTest : public ShapeServiceTest {
 protected:
  GuideServiceTest() : ShapeServiceTest("guide", 20) {
    bus_.Subscribe(kGuidanceChannel, [this](const guidance_t& told) { guidance_.push_back(told); });
    bus_.Subscribe(kAdviceChannel, [this](const advice_t& told) {
      advice_[told.agent] = told;
      ++num_advice_;
    });
  }

  // The photos of the place become registered ones of the submap, as far as they are not.
  void Register(const TestPlace& place) {
    for (const auto& [id, photo] : place.photos()) {
      if (id <= num_registered_) continue;
      image_t image{};
      image.image_id = id;
      image.agent = photo.agent;
      image.name = photo.name;
      Commit(image);
      registration_t registration{};
      registration.image_id = id;
      registration.submap_id = kSubmap;
      registration.epoch = 1;
      registration.state = registration_t::REGISTERED;
      Commit(registration);
      num_registered_ = id;
    }
  }
  void Show(const TestPlace& place, uint64_t version) {
    ShapeServiceTest::Show(*place.MakeShape(kSubmap, version));
  }
  static GuideOptions Options() {
    GuideOptions options;
    options.work_share = 1;
    return options;
  }
  int64_t Version() const { return guidance_.empty() ? 0 : guidance_.back().version; }

  int64_t num_registered_ = 0;
  std::vector<guidance_t> guidance_;
  std::map<std::string, advice_t> advice_;
  int num_advice_ = 0;
};

TEST_F(GuideServiceTest, TellsOfAPlaceAndAdvisesItsAgents) {
  TestPlace place(20, 4, 6000);
  place.Walk("alice", 4, 8, 6);
  place.Walk("bob", 9, 13, 6);
  Register(place);
  Show(place, 10);
  const GuideService guide(node_, Options());
  ASSERT_TRUE(WaitFor([&] { return Version() == 10 && advice_.size() == 2; }));
  EXPECT_EQ(guidance_.back().submap_id, kSubmap);
  EXPECT_EQ(guidance_.back().author, "guide");
  EXPECT_EQ(guidance_.back().place.num_photos, 12);
  EXPECT_GT(guidance_.back().place.good_share, 0);
  EXPECT_NE(guidance_.back().place.sentence, "");
  EXPECT_EQ(advice_["alice"].author, "guide");
  EXPECT_EQ(advice_["alice"].last_image_id, 6);
  EXPECT_GT(advice_["alice"].num_stations, 0);
  EXPECT_GT(advice_["bob"].num_stations, 0);
  EXPECT_NE(advice_["alice"].stations[0].cam_from_world_xyz[0],
            advice_["bob"].stations[0].cam_from_world_xyz[0]);

  place.Walk("bob", 13, 16, 3);
  Register(place);
  Show(place, 20);
  ASSERT_TRUE(WaitFor([&] { return Version() == 20; })) << "the place has grown";
  ASSERT_TRUE(WaitFor([&] { return advice_["bob"].last_image_id == 15; }));
  const size_t before = guidance_.size();
  const int advice_before = num_advice_;
  ASSERT_TRUE(WaitFor([&] { return guidance_.size() > before && num_advice_ > advice_before; }))
      << "it is told again";
  EXPECT_EQ(Version(), 20);
}

class ThrowingGuideTest : public GuideServiceTest {
 protected:
  // The first `num` guidances throw.
  void ThrowFirst(int num) {
    node_.steps().OnBegin([this, num](const Step& step) {
      if (step.item == kSubmap && ++num_begun_ <= num) throw std::runtime_error("no guidance");
    });
  }
  // Each shape begins one.
  void ShowUntilBegun(const TestPlace& place, int num) {
    while (num_begun_ < num) {
      const int before = num_begun_;
      Show(place, 10 * (before + 1));
      ASSERT_TRUE(WaitFor([&] { return num_begun_ > before; }));
    }
  }

  std::atomic<int> num_begun_{0};
};

TEST_F(ThrowingGuideTest, APlaceOnWhichAnExceptionComesIsGuidedAtALaterShape) {
  TestPlace place;
  place.Walk("alice", 2, 8, 6);
  Register(place);
  ThrowFirst(2);
  const GuideService guide(node_, Options());
  ShowUntilBegun(place, 3);
  ASSERT_TRUE(WaitFor([&] { return Version() == 30; }));
}

TEST_F(ThrowingGuideTest, APlaceThatThrowsThriceIsLeftOut) {
  TestPlace place;
  place.Walk("alice", 2, 8, 6);
  Register(place);
  ThrowFirst(100);
  const GuideService guide(node_, Options());
  ShowUntilBegun(place, 3);
  Show(place, 100);
  EXPECT_FALSE(loop_.RunUntil([&] { return num_begun_ > 3; }, 2));
  EXPECT_EQ(Version(), 0);
}

TEST_F(GuideServiceTest, APlaceThatHasEndedIsNotSpokenOf) {
  TestPlace place;
  place.Walk("alice", 2, 8, 6);
  Register(place);
  Show(place, 10);
  const GuideService guide(node_, Options());
  ASSERT_TRUE(WaitFor([&] { return advice_.size() == 1; }));
  submap_end_t end{};
  end.submap_id = kSubmap;
  Commit(end);
  loop_.RunUntil([] { return false; }, 0.5);
  const size_t before = guidance_.size();
  const int advice_before = num_advice_;
  loop_.RunUntil([] { return false; }, 6);  // above the period of what is told again
  EXPECT_EQ(guidance_.size(), before);
  EXPECT_EQ(num_advice_, advice_before);
}

TEST_F(GuideServiceTest, AnAgentIsAdvisedWhereItsNewestPhotoIs) {
  TestPlace place;
  place.Walk("alice", 2, 5, 4);
  place.Walk("bob", 5, 8, 4);
  Register(place);
  seed_t seed{};
  seed.submap_id = 4;
  Commit(seed);
  image_t image{};
  image.image_id = 9;
  image.agent = "bob";
  Commit(image);
  registration_t registration{};
  registration.image_id = 9;
  registration.submap_id = 4;
  registration.state = registration_t::REGISTERED;
  Commit(registration);
  Show(place, 10);
  const GuideService guide(node_, Options());
  ASSERT_TRUE(WaitFor([&] { return Version() == 10 && advice_.count("alice") > 0; }));
  EXPECT_EQ(advice_.count("bob"), 0u);
}

TEST_F(GuideServiceTest, WhereAPhotoWasInVainNoneIsAdvisedAgain) {
  TestPlace place(20, 4, 6000);
  place.Walk("alice", 4, 8, 6);
  Register(place);
  Show(place, 10);
  const GuideService guide(node_, Options());
  ASSERT_TRUE(WaitFor([&] { return advice_.count("alice") > 0; }));
  const station_t first = advice_["alice"].stations.at(0);
  const auto is_advised = [&] {
    const auto& stations = advice_["alice"].stations;
    return std::any_of(stations.begin(), stations.end(), [&](const station_t& station) {
      return std::equal(std::begin(station.cam_from_world_xyz),
                        std::end(station.cam_from_world_xyz), first.cam_from_world_xyz) &&
             std::equal(std::begin(station.cam_from_world_qwxyz),
                        std::end(station.cam_from_world_qwxyz), first.cam_from_world_qwxyz);
    });
  };
  image_t image{};
  image.image_id = 7;
  image.agent = "alice";
  Commit(image);
  registration_t registration{};
  registration.image_id = 7;
  registration.submap_id = kSubmap;
  registration.epoch = 1;
  registration.state = registration_t::DEFERRED;
  Commit(registration);
  ASSERT_TRUE(WaitFor([&] { return !is_advised(); })) << "without a new shape";
  EXPECT_GT(advice_["alice"].num_stations, 0);
  Show(place, 20);
  ASSERT_TRUE(WaitFor([&] { return advice_["alice"].version == 20; }));
  EXPECT_FALSE(is_advised()) << "nor with one";
  registration.state = registration_t::REGISTERED;
  Commit(registration);
  EXPECT_TRUE(WaitFor(is_advised)) << "the shape does not have the photo yet";
}

TEST_F(GuideServiceTest, ShapesThatCannotBeReadHoldUpNobody) {
  TestPlace place;
  place.Walk("alice", 2, 8, 6);
  Register(place);
  Show(place, 10);
  told_.manifest_blob = mapper_.blobs().Serve(Bytes(told_.manifest_bytes, 7));
  const GuideService guide(node_, Options());
  EXPECT_FALSE(loop_.RunUntil([&] { return Version() > 0; }, 2.5));
  Show(place, 20);
  EXPECT_TRUE(WaitFor([&] { return Version() == 20; }));
}

}  // namespace skein::guide_service_test
