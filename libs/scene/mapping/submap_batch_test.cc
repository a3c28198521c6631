#include <gtest/gtest.h>

#include <numeric>
#include <random>
#include <vector>

#include "testing/submap_rig.h"
#include "testing/test_random.h"

namespace skein::submap_batch_test {

std::vector<int64_t> Ids(int64_t first, int64_t last) {
  std::vector<int64_t> ids(last - first + 1);
  std::iota(ids.begin(), ids.end(), first);
  return ids;
}

// A submap of the first photos; other ones hold the rest.
class Divided {
 public:
  Divided(const SyntheticOptions& options, const std::vector<std::vector<int64_t>>& others)
      : Divided(MakeScene(options), others) {}
  Divided(const SyntheticScene& scene, const std::vector<std::vector<int64_t>>& others)
      : run(SyntheticOptions()), others_(others) {
    run.scene = scene;
    EXPECT_TRUE(run.Start(0, 2, 2));
    for (const std::vector<int64_t>& theirs : others) {
      for (const int64_t id : theirs) run.map.SetHeldElsewhere(id, true);
    }
    for (size_t i = 0; i < run.scene.photos.size(); ++i) {
      if (i != 0 && i != 2) run.Feed(i);
    }
    EXPECT_EQ(run.NumRegistered(), others[0][0] - 1);
    run.events.clear();
  }
  bool Batch() { return run.map.MapAsBatch({true, others_, nullptr}, run.Sink()); }

  SubmapRig run;

 private:
  const std::vector<std::vector<int64_t>> others_;
};

TEST(Submap, ABatchTakesThePhotosOfAnotherMapOfThePlace) {
  Divided place(SyntheticOptions{}, {Ids(6, 8)});
  EXPECT_TRUE(place.Batch());
  EXPECT_EQ(place.run.NumRegistered(), 8);
  EXPECT_LT(place.run.PositionErrorPercent(), 0.3);
  for (const PhotoEvent& event : place.run.events) {
    EXPECT_EQ(event.state, PhotoEvent::State::kRegistered);
    EXPECT_GT(event.image_id, 5);
  }
}

// statue-of-liberty in one order: 56 of 120 photos all at once, 97 from the map that was there.
// Here photo 4 has no place in a new map.
TEST(Submap, ABatchGrowsFromTheMapWhereANewOneWouldLosePhotos) {
  Divided place(SyntheticOptions{}, {Ids(6, 8)});
  place.run.map.LeaveOut(4);
  EXPECT_TRUE(place.Batch());
  EXPECT_TRUE(place.run.map.map().IsRegistered(4));
  EXPECT_EQ(place.run.NumRegistered(), 8);
  EXPECT_LT(place.run.PositionErrorPercent(), 0.3);
}

// Photos 1 to 12 of one place, the others of a second one: an object stands in both, on the left.
SyntheticScene OneObjectInTwoPlaces() {
  SyntheticScene scene;
  std::mt19937 random(1);
  const auto add_points = [&](int num, double left, double right, int place) {
    for (int i = 0; i < num; ++i) {
      scene.points.emplace_back(Uniform(left, right, &random), Uniform(-2, 2, &random),
                                Uniform(-0.3, 0.3, &random));
      scene.place_of_point.push_back(place);
    }
  };
  add_points(300, -3, 0, 0);
  for (const int place : {1, 2}) {
    add_points(500, 0, 5, place);
    for (int i = 0; i < (place == 1 ? 12 : 2); ++i) {
      scene.AddPose(Eigen::Matrix3d::Identity(), {-1 + 0.3 * i, 0.1 * place, -8});
      scene.place_of_photo.push_back(place);
    }
  }
  SyntheticOptions options;
  options.camera = {1600, 1200, 1000};
  Photograph(options, &random, &scene);
  return scene;
}

// A submap of the second place is no reason to go without the photos of the first one that a third
// submap holds.
TEST(Submap, ABatchLeavesPhotosOfASimilarPlaceWhereTheyAre) {
  Divided place(OneObjectInTwoPlaces(), {Ids(10, 12), Ids(13, 14)});
  EXPECT_TRUE(place.Batch());
  EXPECT_EQ(place.run.NumRegistered(), 12);
  for (const int64_t id : Ids(13, 14)) EXPECT_FALSE(place.run.map.map().IsRegistered(id)) << id;
}

}  // namespace skein::submap_batch_test
