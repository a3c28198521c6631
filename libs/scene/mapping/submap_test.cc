#include "mapping/submap.h"

#include <gtest/gtest.h>

#include "mapping/checkpoint.h"
#include "sfm/model_io.h"
#include "testing/submap_rig.h"

namespace skein::submap_test {

TEST(Submap, APhotoThatAnotherSubmapHoldsIsNotTriedUntilThatIsOver) {
  SubmapRig rig({});
  ASSERT_TRUE(rig.Start(0, 2));
  rig.map.SetHeldElsewhere(2, true);
  rig.Feed(1);
  rig.map.Consolidate(rig.Sink());
  EXPECT_FALSE(rig.map.map().IsRegistered(2));
  rig.map.SetHeldElsewhere(2, false);
  rig.map.Enqueue(2);
  rig.map.Consolidate(rig.Sink());
  EXPECT_TRUE(rig.map.map().IsRegistered(2));
}

TEST(Submap, ShowsAPhotoThatItDoesNotHoldAsItWouldHoldIt) {
  SubmapRig rig({});
  ASSERT_TRUE(rig.Start(0, 2));
  for (const size_t photo : {3, 4, 5}) rig.Feed(photo);
  rig.map.SetHeldElsewhere(2, true);
  rig.Add(1);
  const SharedImages shown = rig.map.ExportShared({2, 3});
  ASSERT_EQ(shown.size(), 2u);
  EXPECT_EQ(shown[0].image_id, 2);
  EXPECT_GT(shown[0].points.size(), 100u);
  EXPECT_FALSE(rig.map.map().IsRegistered(2));
}

TEST(Submap, ShowsAPhotoAgainAsBefore) {
  SubmapRig rig({});
  ASSERT_TRUE(rig.Start(0, 2));
  for (const size_t photo : {3, 4, 6, 7}) rig.Feed(photo);
  for (const size_t photo : {1, 5}) {
    rig.map.SetHeldElsewhere(static_cast<int64_t>(photo) + 1, true);
    rig.Add(photo);
  }
  const SharedImages shown = rig.map.ExportShared({2, 6});
  const SharedImages again = rig.map.ExportShared({6, 2, 3});
  ASSERT_EQ(shown.size(), 2u);
  ASSERT_EQ(again.size(), 3u);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(again[0].tvec[i], shown[1].tvec[i], 1e-9);
    EXPECT_NEAR(again[1].tvec[i], shown[0].tvec[i], 1e-9);
  }
  EXPECT_EQ(again[0].points.size(), shown[1].points.size());
}

TEST(Submap, LeavesAPhotoToTheSubmapThatSeesFarMoreOfItsPoints) {
  SubmapRig run(SyntheticOptions{});
  run.FeedAll();
  const Reconstruction other = run.map.map().reconstruction();
  const Reconstruction& ours = run.map.map().reconstruction();
  for (Point2DIdx i = 0; i < ours.Image(5).NumPoints2D(); ++i) {
    const bool is_kept = 3 * ours.Image(5).NumPoints3D() < other.Image(5).NumPoints3D();
    if (ours.Image(5).Point2D(i).HasPoint3D() && !is_kept) run.map.map().DeleteObservation(5, i);
  }
  run.events.clear();
  run.map.YieldPhotosTo(other, run.Sink());
  ASSERT_EQ(run.events.size(), 1u);
  EXPECT_EQ(run.events[0].image_id, 5);
  EXPECT_EQ(run.events[0].state, PhotoEvent::State::kWithdrawn);
  EXPECT_EQ(run.NumRegistered(), 7);
}

TEST(Submap, GivesTheSameMapForTheSameCalls) {
  SyntheticOptions options;
  options.num_photos = 16;
  SubmapRig a(options), b(options);
  a.FeedAll();
  b.FeedAll();
  EXPECT_EQ(EncodeModel(a.map.map().reconstruction()), EncodeModel(b.map.map().reconstruction()));
}

TEST(Submap, GoesOnFromACheckpoint) {
  SyntheticOptions options;
  options.num_photos = 16;
  SubmapRig run(options);
  ASSERT_TRUE(run.Start(0, 2));
  for (size_t i = 3; i < 10; ++i) run.Feed(i);
  const ModelArchive archive = SaveSubmap(&run.map);
  SubmapRig other(options);
  const auto photos = PhotosOfArchive(archive);
  ASSERT_TRUE(photos.ok());
  for (const int64_t id : *photos) other.Add(id - 1);
  ASSERT_TRUE(RestoreSubmap(archive, &other.map).ok());
  EXPECT_EQ(other.NumRegistered(), run.NumRegistered());
  EXPECT_EQ(other.map.Statistics().num_points, run.map.Statistics().num_points);
  for (size_t i = 10; i < 16; ++i) other.Feed(i);
  EXPECT_EQ(other.NumRegistered(), run.NumRegistered() + 6);
  EXPECT_LT(other.PositionErrorPercent(), 0.5);
}

TEST(Submap, RefusesADamagedArchive) {
  SubmapRig run(SyntheticOptions{});
  run.FeedAll();
  const ModelArchive archive = SaveSubmap(&run.map);
  for (const auto& [name, bytes] : archive) {
    ModelArchive damaged = archive;
    damaged[name].resize(bytes.size() / 2);
    EXPECT_FALSE(RestoreSubmap(damaged, &run.map).ok()) << name;
    damaged.erase(name);
    EXPECT_FALSE(RestoreSubmap(damaged, &run.map).ok()) << name;
  }
  EXPECT_EQ(run.NumRegistered(), 8);
}

}  // namespace skein::submap_test
