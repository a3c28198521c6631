#include "mapping/supported_photos.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "core/limits.h"
#include "testing/submap_rig.h"

namespace skein::supported_photos_test {

// Photos up to `last` and those above it: `num_common` points stay common. Of the others every
// second one stays with the photos up to `last`, the rest with those above.
void Divide(ImageId last, int num_common, SceneMap* map) {
  for (const Point3DId id : map->reconstruction().Point3DIds()) {
    const std::vector<TrackElement> track = map->reconstruction().Point3D(id).Track().Elements();
    const auto is_low = [&](const TrackElement& element) { return element.image_id <= last; };
    const auto num_low = std::count_if(track.begin(), track.end(), is_low);
    const bool can_be_common = num_low >= 2 && num_low < static_cast<int>(track.size());
    if (can_be_common && num_common-- > 0) continue;
    for (const TrackElement& element : track) {
      if (!map->reconstruction().ExistsPoint3D(id)) break;  // of one observation left
      if (is_low(element) == (id % 2 == 0))
        map->DeleteObservation(element.image_id, element.point2D_idx);
    }
  }
}

int NumKept(ImageId last, int num_common) {
  SubmapRig run(SyntheticOptions{});
  run.FeedAll();
  EXPECT_EQ(run.NumRegistered(), 8);
  Divide(last, num_common, &run.map.map());
  KeepSupportedPhotos(&run.map.map());
  return run.NumRegistered();
}

TEST(KeepSupportedPhotos, KeepsAMapThatHangsTogether) { EXPECT_EQ(NumKept(8, 0), 8); }

// `skein sim --scenario disjoint`, two agents in turn: facades that look alike held photos of both
// agents together by few points, and the map of all was up to 33 % of its extent wrong.
TEST(KeepSupportedPhotos, LeavesOutAPartThatHangsOnFewPoints) {
  EXPECT_EQ(NumKept(5, limits::kMinPoseInliers - 1), 5);
  EXPECT_EQ(NumKept(3, limits::kMinPoseInliers - 1), 5);
}

TEST(KeepSupportedPhotos, LeavesOutAPhotoWithFewPoints) {
  EXPECT_EQ(NumKept(7, limits::kMinPoseInliers - 1), 7);
  EXPECT_EQ(NumKept(7, 2 * limits::kMinPoseInliers), 8);
}

TEST(KeepSupportedPhotos, LeavesNothingWithoutPoints) {
  SceneMap map;
  KeepSupportedPhotos(&map);
  EXPECT_EQ(map.reconstruction().NumRegImages(), 0u);
}

}  // namespace skein::supported_photos_test
