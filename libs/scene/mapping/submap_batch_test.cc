#include <gtest/gtest.h>

#include <numeric>
#include <vector>

#include "testing/submap_rig.h"

namespace skein::submap_batch_test {

std::vector<int64_t> Ids(int64_t first, int64_t last) {
  std::vector<int64_t> ids(last - first + 1);
  std::iota(ids.begin(), ids.end(), first);
  return ids;
}

// A submap of photos 1 to `last`; another one holds the rest.
class Divided {
 public:
  Divided(const SyntheticOptions& options, int64_t last) : run(options) {
    others_ = Ids(last + 1, static_cast<int64_t>(run.scene.photos.size()));
    EXPECT_TRUE(run.Start(0, 2));
    for (const int64_t id : others_) run.map.SetHeldElsewhere(id, true);
    for (size_t i = 0; i < run.scene.photos.size(); ++i) {
      if (i != 0 && i != 2) run.Feed(i);
    }
    EXPECT_EQ(run.NumRegistered(), last);
    run.events.clear();
  }
  bool Batch() { return run.map.MapAsBatch({true, {others_}, nullptr}, run.Sink()); }

  SubmapRig run;

 private:
  std::vector<int64_t> others_;
};

TEST(Submap, ABatchTakesThePhotosOfAnotherMapOfThePlace) {
  Divided place(SyntheticOptions{}, 5);
  EXPECT_TRUE(place.Batch());
  EXPECT_EQ(place.run.NumRegistered(), 8);
  EXPECT_LT(place.run.PositionErrorPercent(), 0.3);
  for (const PhotoEvent& event : place.run.events) {
    EXPECT_EQ(event.state, PhotoEvent::State::kRegistered);
    EXPECT_GT(event.image_id, 5);
  }
}

TEST(Submap, ABatchThatWouldLosePhotosIsDropped) {
  Divided place(SyntheticOptions{}, 5);
  place.run.map.LeaveOut(4);
  EXPECT_FALSE(place.Batch());
  EXPECT_EQ(place.run.NumRegistered(), 5);
}

}  // namespace skein::submap_batch_test
