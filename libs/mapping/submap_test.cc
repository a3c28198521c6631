#include "mapping/submap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "base/similarity_transform.h"
#include "map/filters.h"
#include "map/model_io.h"
#include "map/points_anew.h"
#include "mapping/checkpoint.h"
#include "testing/synthetic_scene.h"

namespace skein {
namespace {

class Rig {
 public:
  explicit Rig(const SyntheticOptions& options, SubmapOptions submap = {})
      : scene(MakeScene(options)), map(submap) {}

  void Add(size_t photo) {
    ASSERT_TRUE(map.AddPhoto(scene.photos[photo]).ok());
    ASSERT_TRUE(map.AddPairs(scene.photos[photo].image_id, scene.pairs[photo]).ok());
    std::vector<std::pair<uint32_t, double>> distances;
    for (const TwoViewPair& pair : scene.pairs[photo]) {
      distances.emplace_back(static_cast<uint32_t>(pair.other_id), 0.8);
    }
    map.AddSimilar(scene.photos[photo].image_id, distances);
  }
  Submap::EventSink Sink() {
    return [this](const PhotoEvent& event) { events.push_back(event); };
  }
  bool Start(size_t a, size_t b, double min_angle_deg = 8) {
    Add(a);
    Add(b);
    InitialPairOptions options;
    options.min_triangulation_angle_deg = min_angle_deg;
    return map.Start(options, a + 1, b + 1, Sink()).status.ok();
  }
  void Feed(size_t photo) {
    Add(photo);
    map.Enqueue(photo + 1);
    while (map.Step(Sink())) continue;
  }
  void FeedAll() {
    ASSERT_TRUE(Start(0, 2));
    for (size_t i = 0; i < scene.photos.size(); ++i) {
      if (i != 0 && i != 2) Feed(i);
    }
  }
  int NumRegistered() const { return map.Statistics().num_images; }
  // RMSE of positions in percent of the scene's size after a similarity.
  double PositionErrorPercent() const {
    std::vector<Eigen::Vector3d> from, to;
    for (const ImageId id : map.map().reconstruction().RegImageIds()) {
      from.push_back(map.map().reconstruction().Image(id).ProjectionCenter());
      to.push_back(scene.Center(id - 1));
    }
    colmap::SimilarityTransform3 transform;
    transform.Estimate<true>(from, to);
    double sum = 0;
    for (size_t i = 0; i < from.size(); ++i) {
      transform.TransformPoint(&from[i]);
      sum += (from[i] - to[i]).squaredNorm();
    }
    return 100 * std::sqrt(sum / from.size()) / 4.0;
  }
  double Focal() const { return map.map().reconstruction().Camera(1).Params(0); }

  SyntheticScene scene;
  Submap map;
  std::vector<PhotoEvent> events;
};

TEST(Submap, APhotoThatAnotherSubmapHoldsIsNotTriedUntilThatIsOver) {
  Rig rig({});
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
  Rig rig({});
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

TEST(Submap, RegistersAllPhotosOfAnArc) {
  Rig run(SyntheticOptions{});
  run.FeedAll();
  EXPECT_EQ(run.NumRegistered(), 8);
  EXPECT_LT(run.PositionErrorPercent(), 0.3);
  run.map.Finish(run.Sink());
  EXPECT_LT(run.PositionErrorPercent(), 0.3);
  EXPECT_GT(run.map.Statistics().mean_track_length, 4);
}

using Observations = std::set<std::pair<ImageId, Point2DIdx>>;

std::set<Observations> TracksOf(const SceneMap& map) {
  std::set<Observations> tracks;
  for (const auto& [id, point] : map.reconstruction().Points3D()) {
    Observations track;
    for (const colmap::TrackElement& element : point.Track().Elements()) {
      track.emplace(element.image_id, element.point2D_idx);
    }
    tracks.insert(track);
  }
  return tracks;
}

SyntheticOptions NoisyArc() {
  SyntheticOptions options;
  options.num_photos = 14;
  options.noise_px = 1;
  options.outlier_ratio = 0.1;
  return options;
}

TEST(Submap, FinishedTracksHardlyHangOnTheOrderOfThePhotos) {
  Rig ahead(NoisyArc()), back(NoisyArc());
  ahead.FeedAll();
  ASSERT_TRUE(back.Start(13, 11));
  back.Feed(12);
  for (size_t i = 11; i-- > 0;) back.Feed(i);
  std::vector<std::set<Observations>> tracks;
  for (Rig* rig : {&ahead, &back}) {
    rig->map.Finish(rig->Sink());
    ASSERT_EQ(rig->NumRegistered(), 14);
    tracks.push_back(TracksOf(rig->map.map()));
  }
  const auto in_both = std::count_if(tracks[0].begin(), tracks[0].end(),
                                     [&](const auto& track) { return tracks[1].count(track) > 0; });
  EXPECT_GT(in_both, 0.995 * tracks[0].size());
  EXPECT_GT(in_both, 0.995 * tracks[1].size());
}

// A map whose finish is to stop from the n-th question on; 0: never.
class StoppableRig {
 public:
  explicit StoppableRig(int stop_at = 0)
      : stop_at_(stop_at), rig_(NoisyArc(), StoppedBy([this] { return IsStopped(); })) {}

  Rig& operator*() { return rig_; }
  Rig* operator->() { return &rig_; }
  void StopAt(int n) {
    stop_at_ = n;
    num_asked_ = 0;
  }
  int num_asked() const { return num_asked_; }

 private:
  static SubmapOptions StoppedBy(std::function<bool()> stop) {
    SubmapOptions options;
    options.max_images_begin_anew = 0;  // a finish alone is to ask
    options.stop = std::move(stop);
    return options;
  }
  bool IsStopped() { return ++num_asked_ >= stop_at_ && stop_at_ > 0; }

  int stop_at_;
  int num_asked_ = 0;
  Rig rig_;
};

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

TEST(Submap, AFinishMayStopAfterEachPartAndTheNextOneMakesUpForIt) {
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
  for (int n = 1; n <= num_questions; ++n) {
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
    if (n % 5 != 1) continue;
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
  Rig rig(options);
  rig.FeedAll();
  EXPECT_GT(FilterPointsOfTwoPhotos(&rig.map.map()), 0) << "while photos come they stay";
  rig.map.Finish(rig.Sink());
  EXPECT_EQ(FilterPointsOfTwoPhotos(&rig.map.map()), 0);
}

TEST(Submap, TriangulatesAnewWithWhatThePosesSay) {
  Rig rig(NoisyArc());
  rig.FeedAll();
  rig.map.Finish(rig.Sink());
  const SubmapStatistics before = rig.map.Statistics();
  SceneMap& map = rig.map.map();
  const Eigen::Vector3d shift(0.2, 0, 0);
  for (const Point3DId id : AllPoints(rig.map.map())) {
    if (id % 2 == 0) map.DeletePoint(id);
    if (id % 2 == 1) map.SetPoint(id, map.reconstruction().Point3D(id).XYZ() + shift);
  }
  TriangulateAnew(rig.map.options().triangulation, 2, &rig.map.map());
  FilterPoints(rig.map.options().filter, AllPoints(rig.map.map()), &rig.map.map());
  const SubmapStatistics after = rig.map.Statistics();
  EXPECT_GT(after.num_points * after.mean_track_length,
            0.95 * before.num_points * before.mean_track_length);
  EXPECT_LT(after.mean_reprojection_error_px, 1.2 * before.mean_reprojection_error_px);
}

TEST(Submap, RecoversAFocalPriorThatIsWrongByAQuarterAndDistortion) {
  for (const double factor : {0.75, 1.25}) {
    for (const bool exif : {false, true}) {
      SyntheticOptions options;
      options.num_photos = 16;
      options.prior_factor = factor;
      options.focal_from_exif = exif;
      options.distortion = -0.1;
      Rig run(options);
      run.FeedAll();
      run.map.Finish(run.Sink());
      EXPECT_EQ(run.NumRegistered(), 16) << factor << exif;
      EXPECT_NEAR(run.Focal(), 1000, 5) << factor << exif;
    }
  }
}

TEST(Submap, TakesOtherCameraModels) {
  for (const char* model :
       {"PINHOLE", "RADIAL", "OPENCV", "FULL_OPENCV", "SIMPLE_RADIAL_FISHEYE"}) {
    SubmapOptions submap;
    submap.camera_model = model;
    SyntheticOptions options;
    options.num_photos = 14;
    options.prior_factor = 1.1;
    Rig run(options, submap);
    run.FeedAll();
    run.map.Finish(run.Sink());
    EXPECT_EQ(run.NumRegistered(), 14) << model;
    // A fisheye's projection is not the scene's: it must come close, though.
    const bool fisheye = std::string(model).find("FISHEYE") != std::string::npos;
    EXPECT_LT(run.PositionErrorPercent(), fisheye ? 5.0 : 0.5) << model;
  }
}

TEST(Submap, FocalLengthWithstandsAFewZoomedPhotos) {
  SyntheticOptions options;
  options.num_photos = 16;
  options.prior_factor = 1.1;
  options.zoomed_photos = {5, 11};
  Rig run(options);
  run.FeedAll();
  run.map.Finish(run.Sink());
  EXPECT_NEAR(run.Focal(), 1000, 10);
  EXPECT_GE(run.NumRegistered(), 14);
}

TEST(Submap, LocalBundleAdjustmentsLeaveTheIntrinsics) {
  SyntheticOptions options;
  options.num_photos = 16;
  SubmapOptions submap;
  submap.global_growth = 100;
  Rig run(options, submap);
  ASSERT_TRUE(run.Start(0, 2));
  for (size_t i = 1; i < 13; ++i) {
    if (i != 2) run.Feed(i);
  }
  const std::vector<double> params = run.map.map().reconstruction().Camera(1).Params();
  for (size_t i = 13; i < 16; ++i) run.Feed(i);
  EXPECT_EQ(run.NumRegistered(), 16);
  EXPECT_EQ(run.map.map().reconstruction().Camera(1).Params(), params);
}

TEST(Submap, WithstandsOutliers) {
  SyntheticOptions options;
  options.outlier_ratio = 0.3;
  Rig run(options);
  run.FeedAll();
  EXPECT_EQ(run.NumRegistered(), 8);
  EXPECT_LT(run.PositionErrorPercent(), 0.5);
}

TEST(Submap, RegistersPhotosOfAPlaneOnceTheMapStands) {
  SyntheticOptions options;
  options.shape = SyntheticOptions::Shape::kPlane;
  Rig run(options);
  run.FeedAll();
  EXPECT_EQ(run.NumRegistered(), 8);
  EXPECT_LT(run.PositionErrorPercent(), 1.0);
}

TEST(Submap, RefusesToStartFromPureRotationOrTinyBaseline) {
  SyntheticOptions options;
  options.path = SyntheticOptions::Path::kRotation;
  options.step_deg = 4;
  Rig rotation(options);
  EXPECT_FALSE(rotation.Start(0, 2, 2));
  EXPECT_EQ(rotation.NumRegistered(), 0);
  options = {};
  options.step_deg = 0.1;
  Rig tiny(options);
  EXPECT_FALSE(tiny.Start(0, 1, 2));
  EXPECT_EQ(tiny.NumRegistered(), 0);
}

TEST(Submap, RefusesToStartFromForwardMotion) {
  SyntheticOptions options;
  options.path = SyntheticOptions::Path::kForward;
  Rig run(options);
  EXPECT_FALSE(run.Start(0, 2, 0.5));
}

TEST(Submap, DefersAPhotoWithLowOverlapUntilANeighbourComes) {
  SyntheticOptions options;
  Rig run(options);
  // Photo 7 is known to photo 6 only, and photo 6 comes later.
  run.scene.pairs[7].erase(run.scene.pairs[7].begin(), run.scene.pairs[7].begin() + 6);
  ASSERT_TRUE(run.Start(0, 2));
  run.Feed(1);
  run.Feed(7);
  EXPECT_EQ(run.events.back().image_id, 8);
  EXPECT_EQ(run.events.back().state, PhotoEvent::State::kDeferred);
  for (const size_t i : {3, 4, 5, 6}) run.Feed(i);
  EXPECT_TRUE(run.map.map().IsRegistered(8));
}

TEST(Submap, DefersAPhotoWhosePointsLieInOneCorner) {
  SyntheticOptions options;
  options.num_points = 20000;
  Rig run(options);
  ASSERT_TRUE(run.Start(0, 2));
  run.Feed(1);
  // Only matches in a patch of 30 px are left.
  TwoViewPairs pairs = run.scene.pairs[3];
  for (TwoViewPair& pair : pairs) {
    std::vector<std::pair<uint32_t, uint32_t>> corner;
    for (const auto& inlier : pair.inliers) {
      const Keypoint& keypoint = run.scene.photos[3].keypoints[inlier.first];
      if (std::abs(keypoint.x - 600) < 15 && std::abs(keypoint.y - 450) < 15) {
        corner.push_back(inlier);
      }
    }
    pair.inliers = corner;
  }
  run.scene.pairs[3] = pairs;
  run.Feed(3);
  EXPECT_FALSE(run.map.map().IsRegistered(4));
  EXPECT_EQ(run.events.back().refusal.text, "pose badly determined by its inliers")
      << run.events.back().num_visible << " points";
}

// Every `every`-th keypoint of `photo` that sees the first twin is matched to the second one.
// Keypoints of the second twin have no matches.
void ConfuseTwins(size_t photo, int every, SyntheticScene* scene) {
  const int half = static_cast<int>(scene->points.size()) / 2;
  for (TwoViewPair& pair : scene->pairs[photo]) {
    std::map<int, uint32_t> keypoint_of;
    const std::vector<int>& seen = scene->visible[pair.other_id - 1];
    for (size_t k = 0; k < seen.size(); ++k) keypoint_of[seen[k]] = static_cast<uint32_t>(k);
    std::vector<std::pair<uint32_t, uint32_t>> inliers;
    for (const auto& [mine, other] : pair.inliers) {
      const int point = scene->visible[photo][mine];
      if (point >= half) continue;
      if (point % every != 0) {
        inliers.emplace_back(mine, other);
      } else if (keypoint_of.count(point + half) > 0) {
        inliers.emplace_back(mine, keypoint_of[point + half]);
      }
    }
    pair.inliers = inliers;
  }
}

SyntheticOptions Twins() {
  SyntheticOptions options;
  options.shape = SyntheticOptions::Shape::kTwins;
  return options;
}

SyntheticOptions ManyPhotosOfTwins(int num_photos) {
  SyntheticOptions options = Twins();
  options.num_points = 1600;
  options.num_photos = num_photos;
  options.step_deg = 5;
  return options;
}

TEST(Submap, DefersAPhotoWhoseMatchesAgreeOnTwoPlaces) {
  Rig run(Twins());
  ConfuseTwins(3, 2, &run.scene);
  ASSERT_TRUE(run.Start(0, 2));
  run.Feed(1);
  run.Feed(3);
  EXPECT_EQ(run.events.back().image_id, 4);
  EXPECT_EQ(run.events.back().state, PhotoEvent::State::kDeferred);
  EXPECT_EQ(run.events.back().refusal.text, "ambiguous: its points agree on two poses");
  // What comes later knows the place.
  for (const size_t i : {4, 5, 6, 7}) run.Feed(i);
  EXPECT_TRUE(run.map.map().IsRegistered(4));
  EXPECT_LT(run.PositionErrorPercent(), 0.3);
}

TEST(Submap, RegistersAPhotoOfWhichAFewMatchesLeadToATwin) {
  Rig run(Twins());
  ConfuseTwins(3, 4, &run.scene);
  ASSERT_TRUE(run.Start(0, 2));
  run.Feed(1);
  run.Feed(3);
  EXPECT_TRUE(run.map.map().IsRegistered(4));
  EXPECT_LT(run.PositionErrorPercent(), 0.3);
}

// A photo of the second twin that comes first gets to the first twin's place. Photos that follow
// contradict it, and it keeps a fraction of its matches.
TEST(Submap, WithdrawsAPhotoThatLaterOnesContradictAndTakesItBackOnNewEvidence) {
  Rig run(ManyPhotosOfTwins(16));
  ConfuseTwins(3, 1, &run.scene);  // all its matches lead to the other twin
  ASSERT_TRUE(run.Start(0, 2));
  run.Feed(1);
  run.Feed(3);
  ASSERT_TRUE(run.map.map().IsRegistered(4));
  for (size_t i = 4; i < 16; ++i) run.Feed(i);
  run.map.Finish(run.Sink());
  const auto withdrawn = std::find_if(run.events.begin(), run.events.end(), [](const auto& event) {
    return event.image_id == 4 && event.state == PhotoEvent::State::kWithdrawn;
  });
  ASSERT_NE(withdrawn, run.events.end());
  EXPECT_FALSE(withdrawn->refusal.text.empty());
  EXPECT_EQ(run.NumRegistered(), 16);
  EXPECT_LT(run.PositionErrorPercent(), 0.3);
}

// A photo of the second twin, and three that match only it and each other, stand at the first
// twin's place as one group. Then photos come that match both groups.
TEST(Submap, MovesAGroupThatGrewInTheWrongPlace) {
  Rig run(ManyPhotosOfTwins(20));
  ConfuseTwins(8, 1, &run.scene);
  for (const size_t photo : {9, 10, 11}) {
    TwoViewPairs& pairs = run.scene.pairs[photo];
    pairs.erase(std::remove_if(pairs.begin(), pairs.end(),
                               [](const TwoViewPair& pair) { return pair.other_id < 9; }),
                pairs.end());
  }
  ASSERT_TRUE(run.Start(0, 2));
  for (size_t i = 1; i < 12; ++i) {
    if (i != 2) run.Feed(i);
  }
  ASSERT_EQ(run.NumRegistered(), 12);
  EXPECT_GT(run.PositionErrorPercent(), 5);
  for (size_t i = 12; i < 20; ++i) run.Feed(i);
  run.map.Finish(run.Sink());
  // Half of the first one's matches stay wrong: it may wait.
  for (ImageId id = 1; id <= 20; ++id) EXPECT_TRUE(id == 9 || run.map.map().IsRegistered(id)) << id;
  EXPECT_LT(run.PositionErrorPercent(), 0.3);
}

TEST(Submap, RegistersAPhotoTurnedOnTheSpotOrHardlyMoved) {
  for (const double distance : {0.0, 0.002}) {
    SyntheticOptions options;
    options.turned_photo = 3;
    options.turned_distance = distance;
    Rig run(options);
    run.FeedAll();
    EXPECT_EQ(run.NumRegistered(), 8) << distance;
    EXPECT_LT(run.PositionErrorPercent(), 0.3) << distance;
    run.map.Finish(run.Sink());
    EXPECT_LT(run.PositionErrorPercent(), 0.3) << distance;
  }
}

TEST(Submap, RegistersPhotosThatMoveForwardOnceTheMapStands) {
  SyntheticOptions options;
  options.path = SyntheticOptions::Path::kArcThenForward;
  options.num_photos = 12;
  Rig run(options);
  run.FeedAll();
  EXPECT_EQ(run.NumRegistered(), 12);
  EXPECT_LT(run.PositionErrorPercent(), 0.5);
}

TEST(Submap, DefersAPhotoWithLowOverlapForGood) {
  Rig run(SyntheticOptions{});
  for (TwoViewPair& pair : run.scene.pairs[3]) pair.inliers.resize(20);
  run.scene.pairs[3].resize(1);
  ASSERT_TRUE(run.Start(0, 2));
  run.Feed(1);
  run.Feed(3);
  EXPECT_EQ(run.events.back().state, PhotoEvent::State::kDeferred);
  EXPECT_EQ(run.events.back().refusal.text, "too few visible points");
  const size_t num_events = run.events.size();
  run.map.RetryDeferred();
  while (run.map.Step(run.Sink())) continue;
  EXPECT_EQ(run.events.size(), num_events);  // told once
}

// Two photos in wrong places, without a point that another could be registered with.
colmap::Reconstruction DeadEnd(const Submap& submap) {
  colmap::Reconstruction model = submap.map().reconstruction();
  for (const Point3DId id : model.Point3DIds()) model.DeletePoint3D(id);
  const std::vector<ImageId> ids = model.RegImageIds();
  for (const ImageId id : ids) {
    if (id > 2) model.DeRegisterImage(id);
  }
  model.Image(2).SetTvec(model.Image(2).Tvec() + Eigen::Vector3d(3, 0, 1));
  return model;
}

TEST(Submap, IsMappedAnewWhereNothingFitsAnyMore) {
  Rig run(SyntheticOptions{});
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
  Rig run(SyntheticOptions{});
  ASSERT_TRUE(run.Start(0, 1, 1));
  ASSERT_TRUE(run.map.ReplaceModel(DeadEnd(run.map)).ok());
  for (const size_t photo : {2, 3, 4, 5, 6, 7}) run.Feed(photo);
  EXPECT_EQ(run.NumRegistered(), 8);
  EXPECT_LT(run.PositionErrorPercent(), 0.3);
}

// Twice the photos show that the other map carries; the others must not be forgotten.
TEST(Submap, ThatIsBegunAnewTriesAllPhotosThatWait) {
  Rig run(SyntheticOptions{});
  ASSERT_TRUE(run.Start(0, 1, 1));
  ASSERT_TRUE(run.map.ReplaceModel(DeadEnd(run.map)).ok());
  for (const size_t photo : {2, 3, 4, 5, 6}) run.Add(photo);
  run.Feed(7);
  EXPECT_EQ(run.NumRegistered(), 8);
}

TEST(Submap, ThatBeganBadlyStaysAsItIsWhenItIsLarge) {
  SubmapOptions options;
  options.max_images_begin_anew = 1;
  Rig run(SyntheticOptions{}, options);
  ASSERT_TRUE(run.Start(0, 1, 1));
  ASSERT_TRUE(run.map.ReplaceModel(DeadEnd(run.map)).ok());
  for (const size_t photo : {2, 3, 4, 5, 6, 7}) run.Feed(photo);
  EXPECT_EQ(run.NumRegistered(), 2);
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

TEST(Submap, LeavesAPhotoToTheSubmapThatSeesFarMoreOfItsPoints) {
  Rig run(SyntheticOptions{});
  run.FeedAll();
  const colmap::Reconstruction other = run.map.map().reconstruction();
  const colmap::Reconstruction& ours = run.map.map().reconstruction();
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

TEST(Submap, ThatIsRightStaysAsItIsWhenConsolidated) {
  Rig run(SyntheticOptions{});
  run.FeedAll();
  run.map.Consolidate(run.Sink());
  const Eigen::Vector3d center = run.map.map().reconstruction().Image(5).ProjectionCenter();
  run.events.clear();
  run.map.Consolidate(run.Sink());
  EXPECT_TRUE(run.events.empty());
  EXPECT_EQ(run.map.map().reconstruction().Image(5).ProjectionCenter(), center);
}

TEST(Submap, GivesTheSameMapForTheSameCalls) {
  SyntheticOptions options;
  options.num_photos = 16;
  Rig a(options), b(options);
  a.FeedAll();
  b.FeedAll();
  EXPECT_EQ(EncodeModel(a.map.map().reconstruction()), EncodeModel(b.map.map().reconstruction()));
}

TEST(Submap, GoesOnFromACheckpoint) {
  SyntheticOptions options;
  options.num_photos = 16;
  Rig run(options);
  ASSERT_TRUE(run.Start(0, 2));
  for (size_t i = 3; i < 10; ++i) run.Feed(i);
  const ModelArchive archive = SaveSubmap(&run.map);
  Rig other(options);
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
  Rig run(SyntheticOptions{});
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

TEST(Submap, BackgroundBundleAdjustmentKeepsPhotosInTheirPlace) {
  SyntheticOptions options;
  options.num_photos = 30;
  options.step_deg = 5;
  SubmapOptions submap;
  submap.background = true;
  Rig run(options, submap);
  run.FeedAll();
  while (run.map.Maintain(true, run.Sink())) continue;
  EXPECT_EQ(run.NumRegistered(), 30);
  EXPECT_LT(run.PositionErrorPercent(), 0.5);
  // A finish finds nothing left to refine before it triangulates anew.
  const Eigen::Vector3d center = run.map.map().reconstruction().Image(5).ProjectionCenter();
  run.map.Consolidate(run.Sink());
  EXPECT_EQ(run.map.map().reconstruction().Image(5).ProjectionCenter(), center);
  EXPECT_EQ(run.map.EstimateConsolidateS(), 0);
  EXPECT_GT(run.map.EstimateFinishS(), 0);
}

}  // namespace
}  // namespace skein
