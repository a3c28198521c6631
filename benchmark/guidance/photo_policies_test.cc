#include "benchmark/guidance/photo_policies.h"

#include <gtest/gtest.h>

namespace skein::photo_policies_test {

// Photos a metre apart along x that look along z; photo i has its centre in x = i.
class RowOfPhotos : public PhotoPool {
 public:
  explicit RowOfPhotos(int size) {
    for (int i = 0; i < size; ++i) {
      GuidedPhoto photo;
      photo.image_id = i + 1;
      photo.cam_from_world.translation.x() = -i;
      photos_.push_back(photo);
    }
  }

  bool Shows(int, const SurfaceSample&) const override { return false; }
  PoolMap MapOf(const std::vector<int>& taken) const override { return EmptyMapOf(taken); }
  int CommonPoints(int, const std::vector<int>&) const override { return 0; }
};

TEST(PhotoPolicies, ForAStationTheNearestLeftPhotoIsTaken) {
  const RowOfPhotos pool(12);
  Capture capture;
  capture.left = {0, 1, 3, 5, 8, 9};
  Station station;
  station.cam_from_world = pool.photo(5).cam_from_world;
  station.target = station.cam_from_world.Centre() + 5 * AheadOf(station.cam_from_world);
  EXPECT_EQ(NearestLeft(pool, capture, station), 5);
  capture.left = {0, 1, 3, 8, 9};
  EXPECT_EQ(NearestLeft(pool, capture, station), 3);
  capture.left = {0, 9, 11};
  EXPECT_EQ(NearestLeft(pool, capture, station), 9);
}

}  // namespace skein::photo_policies_test
