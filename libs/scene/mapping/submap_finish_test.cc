#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>
#include <vector>

#include "map/filters.h"
#include "map/points_anew.h"
#include "mapping/checkpoint.h"
#include "testing/submap_rig.h"

namespace skein::submap_finish_test {

using Observations = std::set<std::pair<ImageId, Point2DIdx>>;

std::set<Observations> TracksOf(const SceneMap& map) {
  std::set<Observations> tracks;
  for (const auto& [id, point] : map.reconstruction().Points3D()) {
    Observations track;
    for (const TrackElement& element : point.Track().Elements()) {
      track.emplace(element.image_id, element.point2D_idx);
    }
    tracks.insert(track);
  }
  return tracks;
}

TEST(Submap, FinishedTracksHardlyHangOnTheOrderOfThePhotos) {
  SubmapRig ahead(NoisyArc()), back(NoisyArc());
  ahead.FeedAll();
  ASSERT_TRUE(back.Start(13, 11));
  back.Feed(12);
  for (size_t i = 11; i-- > 0;) back.Feed(i);
  std::vector<std::set<Observations>> tracks;
  for (SubmapRig* rig : {&ahead, &back}) {
    rig->map.Finish(rig->Sink());
    ASSERT_EQ(rig->NumRegistered(), 14);
    tracks.push_back(TracksOf(rig->map.map()));
  }
  const auto in_both = std::count_if(tracks[0].begin(), tracks[0].end(),
                                     [&](const auto& track) { return tracks[1].count(track) > 0; });
  EXPECT_GT(in_both, 0.995 * tracks[0].size());
  EXPECT_GT(in_both, 0.995 * tracks[1].size());
}

// All photos are moved to one spot, so no point has an angle.
TEST(Submap, AFinishLosesNoMapWhosePointsCannotBeTriangulated) {
  SubmapRig run(NoisyArc());
  run.FeedAll();
  run.map.Consolidate(run.Sink());
  ASSERT_EQ(run.NumRegistered(), 14);
  SceneMap& map = run.map.map();
  const Reconstruction model = map.reconstruction();
  const Eigen::Vector3d middle = model.Image(7).ProjectionCenter();
  for (const ImageId id : model.RegImageIds()) {
    const Image& image = model.Image(id);
    map.SetPose(id, image.Qvec(), -(image.RotationMatrix() * middle));
  }
  run.events.clear();
  run.map.Finish(run.Sink());
  EXPECT_EQ(run.NumRegistered(), 14);
  EXPECT_TRUE(run.events.empty());
}

TEST(Submap, AFinishThatIsToStopFromTheStartLeavesTheMapAsItIs) {
  StoppableRig rig;
  rig->FeedAll();
  const std::set<Observations> before = TracksOf(rig->map.map());
  const double error_px = rig->map.Statistics().mean_reprojection_error_px;
  rig->events.clear();
  rig.StopAt(1);
  rig->map.Finish(rig->Sink());
  EXPECT_TRUE(rig->events.empty());
  EXPECT_EQ(TracksOf(rig->map.map()), before);
  EXPECT_EQ(rig->map.Statistics().mean_reprojection_error_px, error_px);
}

TEST(Submap, AFinishMayStopAnywhereAndTheNextOneMakesUpForIt) {
  StoppableRig whole;
  whole->FeedAll();
  const ModelArchive archive = SaveSubmap(&whole->map);
  const SubmapStatistics before = whole->map.Statistics();
  const double error_percent = whole->PositionErrorPercent();
  whole.StopAt(0);
  whole->map.Finish(whole->Sink());
  const int num_questions = whole.num_asked();
  ASSERT_GT(num_questions, 10) << "of a finish that went to its end";
  const size_t num_tracks = TracksOf(whole->map.map()).size();
  const int stride = std::max(1, num_questions / 32);
  for (int k = 0; k * stride < num_questions; ++k) {
    const int n = 1 + k * stride;
    StoppableRig rig;
    for (size_t i = 0; i < rig->scene.photos.size(); ++i) rig->Add(i);
    ASSERT_TRUE(RestoreSubmap(archive, &rig->map).ok());
    rig.StopAt(n);
    rig->map.Finish(rig->Sink());
    const SubmapStatistics stopped = rig->map.Statistics();
    EXPECT_EQ(stopped.num_images, before.num_images) << n;
    EXPECT_LT(rig->PositionErrorPercent(), std::max(error_percent, 0.3)) << n;
    EXPECT_LT(stopped.mean_reprojection_error_px, 1.02 * before.mean_reprojection_error_px) << n;
    EXPECT_GT(stopped.num_points * stopped.mean_track_length,
              0.97 * before.num_points * before.mean_track_length)
        << n;
    if (k % 4 != 0) continue;
    rig.StopAt(0);
    rig->map.Finish(rig->Sink());
    EXPECT_NEAR(TracksOf(rig->map.map()).size(), num_tracks, 0.01 * num_tracks) << n;
  }
}

TEST(Submap, AFinishThatIsToStopTriesNoPhotoAndTheNextOneDoes) {
  StoppableRig rig;
  ASSERT_TRUE(rig->Start(0, 2));
  rig->Add(1);
  rig->map.Enqueue(2);
  rig.StopAt(1);
  rig->map.Finish(rig->Sink());
  EXPECT_FALSE(rig->map.map().IsRegistered(2));
  rig.StopAt(0);
  rig->map.Consolidate(rig->Sink());
  EXPECT_TRUE(rig->map.map().IsRegistered(2));
}

TEST(Submap, AFinishedMapHasNoPointOfTwoPhotosThatDoesNotFit) {
  SyntheticOptions options = NoisyArc();
  options.num_points = 2500;
  options.num_photos = 8;
  options.detection_rate = 0.3;
  SubmapRig rig(options);
  rig.FeedAll();
  EXPECT_GT(FilterPointsOfTwoPhotos(&rig.map.map()), 0) << "while photos come they stay";
  rig.map.Finish(rig.Sink());
  EXPECT_EQ(FilterPointsOfTwoPhotos(&rig.map.map()), 0);
}

TEST(Submap, TriangulatesAnewWithWhatThePosesSay) {
  SubmapRig rig(NoisyArc());
  rig.FeedAll();
  rig.map.Finish(rig.Sink());
  const SubmapStatistics before = rig.map.Statistics();
  SceneMap& map = rig.map.map();
  const Eigen::Vector3d shift(0.2, 0, 0);
  for (const Point3DId id : AllPoints(rig.map.map())) {
    if (id % 2 == 0) map.DeletePoint(id);
    if (id % 2 == 1) map.SetPoint(id, map.reconstruction().Point3D(id).XYZ() + shift);
  }
  TriangulateAnew(2, &rig.map.map());
  FilterPoints(AllPoints(rig.map.map()), &rig.map.map());
  const SubmapStatistics after = rig.map.Statistics();
  EXPECT_GT(after.num_points * after.mean_track_length,
            0.95 * before.num_points * before.mean_track_length);
  EXPECT_LT(after.mean_reprojection_error_px, 1.2 * before.mean_reprojection_error_px);
}

TEST(Submap, ThatIsRightStaysAsItIsWhenConsolidated) {
  SubmapRig run(SyntheticOptions{});
  run.FeedAll();
  run.map.Consolidate(run.Sink());
  const Eigen::Vector3d center = run.map.map().reconstruction().Image(5).ProjectionCenter();
  run.events.clear();
  run.map.Consolidate(run.Sink());
  EXPECT_TRUE(run.events.empty());
  EXPECT_EQ(run.map.map().reconstruction().Image(5).ProjectionCenter(), center);
}

// Of 600 photos of one place each is followed by seconds of bundle adjustment otherwise.
TEST(Maintenance, ALargeMapIsAtRestLater) {
  EXPECT_EQ(RestS(0), 4);
  EXPECT_EQ(RestS(0.4), 4);
  EXPECT_EQ(RestS(1.5), 15);
}

TEST(Submap, BackgroundBundleAdjustmentKeepsPhotosInTheirPlace) {
  SyntheticOptions options;
  options.num_photos = 30;
  options.step_deg = 5;
  SubmapOptions submap;
  submap.background = true;
  SubmapRig run(options, submap);
  run.FeedAll();
  while (run.map.Maintain(std::numeric_limits<double>::infinity(), run.Sink())) continue;
  EXPECT_EQ(run.NumRegistered(), 30);
  EXPECT_LT(run.PositionErrorPercent(), 0.5);
  // A finish finds nothing left to refine before it triangulates again.
  const Eigen::Vector3d center = run.map.map().reconstruction().Image(5).ProjectionCenter();
  run.map.Consolidate(run.Sink());
  EXPECT_EQ(run.map.map().reconstruction().Image(5).ProjectionCenter(), center);
  EXPECT_EQ(run.map.EstimateConsolidateS(), 0);
  EXPECT_GT(run.map.EstimateFinishS(), 0);
}

}  // namespace skein::submap_finish_test
