// What is kept of photos' views while surfels move a little and go.
#include "guidance/sights.h"

#include <gtest/gtest.h>

#include <cmath>

#include "testing/test_poses.h"

namespace skein::sights_test {

constexpr uint32_t kNear = 0, kFar = 1;
constexpr size_t kNumPhotos = 40;

// Photos from about the same place.
GuidedMap PhotosOfOnePlace() {
  GuidedMap map;
  map.cameras = {{1200, 900, 1000, 1000, 600, 450}};
  for (uint32_t i = 0; i < kNumPhotos; ++i) {
    map.photos.push_back({i + 1, 0, 0, LookingAt({0.001 * i, -10, 0}, {0.001 * i, 0, 0})});
  }
  return map;
}

// A surfel 5 away from the photos hides one that is 10 away.
struct HiddenSurfel {
  explicit HiddenSurfel(double max_move) : sights(1, 10, max_move) {
    sights.Place(kNear, {0, -5, 0});
    sights.Place(kFar, {0, 0, 0});
    Update();
  }

  void Update() { sights.Update(map, std::vector<bool>(kNumPhotos, false)); }
  void RemoveNear() { sights.Place(kNear, Eigen::Vector3d::Constant(std::nan(""))); }

  GuidedMap map = PhotosOfOnePlace();
  Sights sights;
};

TEST(Sights, ASurfelIsDrawnWhereItWasUntilItIsTooFarOff) {
  HiddenSurfel scene(0.5);
  ASSERT_EQ(scene.sights.PhotosOf(kNear).size(), kNumPhotos);
  ASSERT_TRUE(scene.sights.PhotosOf(kFar).empty());
  scene.sights.Place(kNear, {0, -4.6, 0});
  scene.Update();
  for (uint32_t photo = 0; photo < kNumPhotos; ++photo) {
    EXPECT_FALSE(scene.sights.HasOtherGrid(photo)) << photo;
  }
  scene.sights.Place(kNear, {0, -4.4, 0});  // 0.6 from where it was drawn
  scene.Update();
  bool any_other = false;
  for (uint32_t photo = 0; photo < kNumPhotos; ++photo) {
    any_other |= scene.sights.HasOtherGrid(photo);
  }
  EXPECT_TRUE(any_other);
  EXPECT_EQ(scene.sights.PhotosOf(kNear).size(), kNumPhotos);
}

// Each photo has drawn what goes, as where bundle adjustment moves surfels that all photos see.
TEST(Sights, WhatHasGoneHidesForSixteenUpdatesAtMost) {
  HiddenSurfel scene(0.5);
  scene.RemoveNear();
  scene.Update();
  EXPECT_TRUE(scene.sights.PhotosOf(kNear).empty()) << "at once";
  EXPECT_EQ(scene.sights.PhotosOf(kFar).size(), 3u) << "a sixteenth, rounded up";
  for (int i = 1; i < 16; ++i) scene.Update();
  EXPECT_EQ(scene.sights.PhotosOf(kFar).size(), kNumPhotos);
}

TEST(Sights, WhereNothingIsHeldWhatHasGoneHidesNoMore) {
  HiddenSurfel scene(0);
  scene.RemoveNear();
  scene.Update();
  EXPECT_EQ(scene.sights.PhotosOf(kFar).size(), kNumPhotos);
}

}  // namespace skein::sights_test
