#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "mapping/rebuild.h"
#include "testing/submap_rig.h"

namespace skein::submap_begun_anew_test {

// Two photos in wrong places, without a point that another could be registered with.
Reconstruction DeadEnd(const Submap& submap) {
  Reconstruction model = submap.map().reconstruction();
  for (const Point3DId id : model.Point3DIds()) model.DeletePoint3D(id);
  const std::vector<ImageId> ids = model.RegImageIds();
  for (const ImageId id : ids) {
    if (id > 2) model.DeRegisterImage(id);
  }
  model.Image(2).SetTvec(model.Image(2).Tvec() + Eigen::Vector3d(3, 0, 1));
  return model;
}

TEST(Submap, IsMappedAnewWhereNothingFitsAnyMore) {
  SubmapRig run(SyntheticOptions{});
  run.FeedAll();
  ASSERT_TRUE(run.map.ReplaceModel(DeadEnd(run.map)).ok());
  ASSERT_EQ(run.NumRegistered(), 2);
  run.events.clear();
  run.map.Consolidate(run.Sink());
  EXPECT_EQ(run.NumRegistered(), 8);
  EXPECT_LT(run.PositionErrorPercent(), 0.3);
  std::set<int64_t> told;
  for (const PhotoEvent& event : run.events) {
    if (event.state == PhotoEvent::State::kRegistered) told.insert(event.image_id);
  }
  EXPECT_EQ(told, (std::set<int64_t>{3, 4, 5, 6, 7, 8}));
}

TEST(Submap, ThatBeganBadlyIsBegunAnewWhileItIsSmall) {
  SubmapRig run(SyntheticOptions{});
  ASSERT_TRUE(run.Start(0, 1, 1));
  ASSERT_TRUE(run.map.ReplaceModel(DeadEnd(run.map)).ok());
  for (const size_t photo : {2, 3, 4, 5, 6, 7}) run.Feed(photo);
  EXPECT_EQ(run.NumRegistered(), 8);
  EXPECT_LT(run.PositionErrorPercent(), 0.3);
}

// Twice the photos show that the other map carries; the others must not be forgotten.
TEST(Submap, ThatIsBegunAnewTriesAllPhotosThatWait) {
  SubmapRig run(SyntheticOptions{});
  ASSERT_TRUE(run.Start(0, 1, 1));
  ASSERT_TRUE(run.map.ReplaceModel(DeadEnd(run.map)).ok());
  for (const size_t photo : {2, 3, 4, 5, 6}) run.Add(photo);
  run.Feed(7);
  EXPECT_EQ(run.NumRegistered(), 8);
}

TEST(Submap, ThatBeganBadlyWaitsWhileALargerMapOfThePlaceGrows) {
  SubmapRig run(SyntheticOptions{});
  ASSERT_TRUE(run.Start(0, 1, 1));
  ASSERT_TRUE(run.map.ReplaceModel(DeadEnd(run.map)).ok());
  run.map.SetHasLargerNeighbour(true);
  for (const size_t photo : {2, 3, 4, 5, 6}) run.Feed(photo);
  EXPECT_EQ(run.NumRegistered(), 2);
  run.map.SetHasLargerNeighbour(false);
  run.Feed(7);
  EXPECT_EQ(run.NumRegistered(), 8);
}

TEST(Submap, ThatBeganBadlyStaysAsItIsWhenItIsLarge) {
  SubmapOptions options;
  options.max_images_all_global = 1;
  SubmapRig run(SyntheticOptions{}, options);
  ASSERT_TRUE(run.Start(0, 1, 1));
  ASSERT_TRUE(run.map.ReplaceModel(DeadEnd(run.map)).ok());
  for (const size_t photo : {2, 3, 4, 5, 6, 7}) run.Feed(photo);
  EXPECT_EQ(run.NumRegistered(), 2);
}

TEST(Submap, ThatIsMappedWithItsPlaceIsNotMappedAgainByItself) {
  SubmapRig run(SyntheticOptions{});
  run.FeedAll();
  ASSERT_TRUE(run.map.ReplaceModel(DeadEnd(run.map)).ok());
  run.map.Finish(run.Sink(), {/*is_allowed=*/false});
  EXPECT_EQ(run.NumRegistered(), 2);
  EXPECT_TRUE(run.map.MapAsBatch({true, {}, nullptr}, run.Sink()));
  EXPECT_EQ(run.NumRegistered(), static_cast<int>(run.scene.photos.size()));
}

TEST(Submap, AMapAnewThatIsNotCompleteIsDropped) {
  StoppableRig whole;
  whole->FeedAll();
  ASSERT_TRUE(whole->map.ReplaceModel(DeadEnd(whole->map)).ok());
  whole.StopAt(0);
  whole->map.RefineUntilStable(whole->Sink());
  const int num_before_rebuild = whole.num_asked();
  ASSERT_EQ(whole->NumRegistered(), 2);

  StoppableRig rig;
  rig->FeedAll();
  ASSERT_TRUE(rig->map.ReplaceModel(DeadEnd(rig->map)).ok());
  rig.StopAt(num_before_rebuild + 10);
  rig->map.Consolidate(rig->Sink());
  EXPECT_GE(rig.num_asked(), num_before_rebuild + 10) << "it was not to stop yet";
  EXPECT_EQ(rig->NumRegistered(), 2);
  rig.StopAt(0);
  rig->map.Consolidate(rig->Sink());
  EXPECT_EQ(rig->NumRegistered(), static_cast<int>(rig->scene.photos.size()));
}

// The matches that are left contradict nothing.
TEST(MatchAgreement, OfAMapThatLostMostOfItsPointsIsWorthAnotherMap) {
  SubmapRig run(SyntheticOptions{});
  run.FeedAll();
  const auto count = [&run] {
    return CountMatches(run.map.options(), run.map.map(), run.map.waiting());
  };
  EXPECT_TRUE(count().IsExplained());
  EXPECT_FALSE(MayWinMatches(run.map.options(), count()));
  Reconstruction model = run.map.map().reconstruction();
  std::vector<Point3DId> points(model.Point3DIds().begin(), model.Point3DIds().end());
  std::sort(points.begin(), points.end());
  for (size_t i = points.size() / 3; i < points.size(); ++i) model.DeletePoint3D(points[i]);
  ASSERT_TRUE(run.map.ReplaceModel(model).ok());
  const MatchAgreement shrunk = count();
  EXPECT_FALSE(shrunk.IsExplained());
  EXPECT_TRUE(MayWinMatches(run.map.options(), shrunk));
  EXPECT_EQ(shrunk.to_win, shrunk.strong - shrunk.strong_agreeing);
}

}  // namespace skein::submap_begun_anew_test
