#include "merging/absorb.h"

#include <gtest/gtest.h>

#include <random>

#include "testing/synthetic_submaps.h"

namespace skein::absorb_test {

// Extent of the world's cameras; errors are stated relative to it.
constexpr double kExtent = 20.0;

// Largest distance of a camera centre from the truth after the best similarity.
double MaxCentreError(const Reconstruction& model, const SyntheticWorld& world) {
  std::vector<Eigen::Vector3d> found, truth;
  for (const ImageId id : model.RegImageIds()) {
    found.push_back(model.Image(id).ProjectionCenter());
    truth.push_back(world.Pose(id).Centre());
  }
  const auto to_truth = SimilarityFromPoints(found, truth);
  EXPECT_TRUE(to_truth);
  double worst = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    worst = std::max(worst, (to_truth->Apply(found[i]) - truth[i]).norm());
  }
  return worst;
}

Similarity AlignSubmaps(const Reconstruction& source, const Reconstruction& target) {
  const Sim3Result result = EstimateSim3(SharedPhotosOf(source, target), {});
  EXPECT_TRUE(result.success) << result.reason;
  return result.target_from_source;
}

struct Case {
  SyntheticOptions options = WallOptions();
  Similarity gauge{3.0, Eigen::Quaterniond(1, 0.3, -0.5, 0.2).normalized(), {5, -2, 8}};
};

class Merge {
 public:
  explicit Merge(const Case& setup, uint64_t seed = 1)
      : world(setup.options, seed),
        target(world.Submap(1, 14, Similarity(), 1.0)),
        source(world.Submap(10, 24, setup.gauge, 1.0)) {}

  SyntheticWorld world;
  Reconstruction target, source;
};

TEST(Absorb, TwoHalvesBecomeOneMapAsGoodAsTheTruth) {
  const Merge m{Case()};
  const AbsorbResult result = Absorb(m.target, m.source, AlignSubmaps(m.source, m.target), {});
  ASSERT_TRUE(result.status.ok()) << result.status.error();
  EXPECT_EQ(result.merged.NumRegImages(), 24u);
  EXPECT_EQ(result.fused.agreeing.size(), 5u);
  EXPECT_EQ(result.fused.added.size(), 10u);
  EXPECT_GT(result.fused.num_fused_points, 0.9 * result.fused.num_common_points);
  EXPECT_LT(MaxCentreError(result.merged, m.world), 0.002 * kExtent);
  EXPECT_LT(result.source_after.mean_error_px, result.source_before.mean_error_px + 0.1);
}

TEST(Absorb, SharedObservationsBelongToOnePoint) {
  const Merge m{Case()};
  const AbsorbResult result = Absorb(m.target, m.source, AlignSubmaps(m.source, m.target), {});
  ASSERT_TRUE(result.status.ok()) << result.status.error();
  int num_across = 0;
  for (const auto& [id, point] : result.merged.Points3D()) {
    bool in_target = false, in_source = false;
    for (const auto& element : point.Track().Elements()) {
      EXPECT_EQ(result.merged.Image(element.image_id).Point2D(element.point2D_idx).Point3DId(), id);
      in_target |= element.image_id < 10;
      in_source |= element.image_id > 14;
    }
    num_across += in_target && in_source;
  }
  EXPECT_GT(num_across, 20);
}

TEST(Absorb, ReconcilesDifferentIntrinsics) {
  Case setup;
  SyntheticWorld world(setup.options, 2);
  const auto target = world.Submap(1, 14, Similarity(), 1.004);
  const auto source = world.Submap(10, 24, setup.gauge, 0.997);
  const AbsorbResult result = Absorb(target, source, AlignSubmaps(source, target), {});
  ASSERT_TRUE(result.status.ok()) << result.status.error();
  EXPECT_NEAR(result.merged.Camera(1).MeanFocalLength() / world.TrueFocalPx(), 1.0, 0.003);
  EXPECT_LT(MaxCentreError(result.merged, world), 0.003 * kExtent);
}

TEST(Absorb, JoinsASourceWhoseFocalLengthIsFarOff) {
  Case setup;
  SyntheticWorld world(setup.options, 2);
  const auto target = world.Submap(1, 14, Similarity(), 1.0);
  const auto source = world.Submap(10, 20, setup.gauge, 1.06);
  const AbsorbResult result = Absorb(target, source, AlignSubmaps(source, target), {});
  ASSERT_TRUE(result.status.ok()) << result.status.error();
  EXPECT_GT(result.fused.num_fused_points, 0.9 * result.fused.num_common_points);
  EXPECT_NEAR(result.merged.Camera(1).MeanFocalLength() / world.TrueFocalPx(), 1.0, 0.003);
}

// Photos 22 to 24 are of a camera of their own, whose focal length got out of hand.
TEST(Absorb, ACameraThatWentAstrayVetoesNoMerge) {
  Case setup;
  setup.options.second_camera_from = 22;
  Merge m{setup};
  m.source.Camera(2).SetFocalLength(1000 * m.world.TrueFocalPx());
  const AbsorbResult result = Absorb(m.target, m.source, AlignSubmaps(m.source, m.target), {});
  ASSERT_TRUE(result.status.ok()) << result.status.error();
  EXPECT_EQ(result.merged.NumRegImages(), 21u);
  EXPECT_EQ(result.left_out, (std::set<ImageId>{22, 23, 24}));
  EXPECT_LT(MaxCentreError(result.merged, m.world), 0.002 * kExtent);
}

TEST(Absorb, KeepsTheSourcesOwnCamera) {
  Case setup;
  setup.options.second_camera_from = 15;
  const Merge m{setup};
  const AbsorbResult result = Absorb(m.target, m.source, AlignSubmaps(m.source, m.target), {});
  ASSERT_TRUE(result.status.ok()) << result.status.error();
  EXPECT_TRUE(result.merged.ExistsCamera(2));
}

TEST(Absorb, RefusesAWrongSimilarity) {
  const Merge m{Case()};
  Similarity wrong = AlignSubmaps(m.source, m.target);
  wrong.translation += Eigen::Vector3d(1.5, 0, 0);
  const AbsorbResult result = Absorb(m.target, m.source, wrong, {});
  EXPECT_FALSE(result.status.ok());
  EXPECT_FALSE(result.status.error().empty());
}

TEST(Absorb, RefusesASlightlyWrongScale) {
  const Merge m{Case()};
  Similarity wrong = AlignSubmaps(m.source, m.target);
  wrong.scale *= 1.3;
  EXPECT_FALSE(Absorb(m.target, m.source, wrong, {}).status.ok());
}

TEST(Absorb, RefusesDifferentKeypointsOfOnePhoto) {
  const Merge m{Case()};
  SyntheticOptions other = Case().options;
  other.num_points += 100;
  const auto source = SyntheticWorld(other, 1).Submap(10, 24, Similarity(), 1.0);
  const AbsorbResult result = Absorb(m.target, source, Similarity(), {});
  EXPECT_FALSE(result.status.ok());
}

TEST(Absorb, LeavesTheModelsAlone) {
  const Merge m{Case()};
  const size_t num_points = m.target.NumPoints3D();
  const Eigen::Vector3d before = m.target.Image(1).ProjectionCenter();
  Absorb(m.target, m.source, AlignSubmaps(m.source, m.target), {});
  EXPECT_EQ(m.target.NumPoints3D(), num_points);
  EXPECT_EQ(m.target.NumRegImages(), 14u);
  EXPECT_EQ(m.target.Image(1).ProjectionCenter(), before);
}

TEST(Absorb, TakesAPhotoThatTheTargetOnlyHasDeferred) {
  const Merge m{Case()};
  Reconstruction target = m.target;
  Image deferred;
  deferred.SetImageId(20);
  deferred.SetCameraId(1);
  std::vector<Eigen::Vector2d> pixels;
  for (const auto& point2D : m.source.Image(20).Points2D()) pixels.push_back(point2D.XY());
  deferred.SetPoints2D(pixels);
  target.AddImage(deferred);
  const AbsorbResult result = Absorb(target, m.source, AlignSubmaps(m.source, target), {});
  ASSERT_TRUE(result.status.ok()) << result.status.error();
  EXPECT_TRUE(result.merged.IsImageRegistered(20));
}

TEST(Absorb, APhotoWithAWrongPoseInOneSideKeepsTheOther) {
  Merge m{Case()};
  m.target.DeRegisterImage(12);
  m.target.Image(12).SetTvec(m.target.Image(12).Tvec() + Eigen::Vector3d(4, 0, 0));
  m.target.RegisterImage(12);
  const AbsorbResult result = Absorb(m.target, m.source, AlignSubmaps(m.source, m.target), {});
  ASSERT_TRUE(result.status.ok()) << result.status.error();
  EXPECT_EQ(result.fused.agreeing.size(), 4u);
  EXPECT_EQ(result.fused.kept_source, std::set<ImageId>{12});
}

TEST(Seam, OfALargeModelIsAPartOfIt) {
  const Merge m{Case()};
  Reconstruction merged = m.target;
  const FuseResult fused =
      FuseModels(m.source, AlignSubmaps(m.source, m.target), Sim3Options(), &merged);
  ASSERT_TRUE(fused.status.ok()) << fused.status.error();
  EXPECT_EQ(SeamOf(fused.agreeing, merged).size(), 24u);
  const std::set<ImageId> seam = SeamOf(fused.agreeing, merged, 10, 6);
  EXPECT_EQ(seam.size(), 11u);
  EXPECT_TRUE(AdjustSeam(seam, SeamIntrinsics(), &merged).usable);
  EXPECT_LT(MaxCentreError(merged, m.world), 0.005 * kExtent);
}

// Photos 1 to `target_last` and 9 to `source_last` of two buildings with one façade.
AbsorbResult AbsorbOfTwoBuildings(int target_last, int source_last) {
  const SyntheticWorld world(WallOptions(SyntheticOptions::Shape::kTwoPlaces), 3);
  const auto target = world.Submap(1, target_last, Similarity(), 1.0);
  const auto source = world.Submap(9, source_last, Case().gauge, 1.0);
  return Absorb(target, source, AlignSubmaps(source, target), {});
}

TEST(Absorb, RefusesTwoBuildingsOfOneFacade) {
  const AbsorbResult result = AbsorbOfTwoBuildings(12, 24);
  EXPECT_FALSE(result.status.ok());
  EXPECT_NE(result.status.error().find("visually similar"), std::string::npos)
      << result.status.error();
}

TEST(Absorb, RefusesAContainedSourceWhereTheTargetHoldsTwoBuildingsForOne) {
  const AbsorbResult result = AbsorbOfTwoBuildings(24, 12);
  EXPECT_FALSE(result.status.ok());
  EXPECT_NE(result.status.error().find("visually similar"), std::string::npos)
      << result.status.error();
}

TEST(Absorb, TakesAContainedSourceOfOnePlace) {
  const Merge m{Case()};
  const auto source = m.world.Submap(9, 12, Case().gauge, 1.0);
  const AbsorbResult result = Absorb(m.target, source, AlignSubmaps(source, m.target), {});
  EXPECT_TRUE(result.status.ok()) << result.status.error();
}

// Of random models whose photos have cameras of their own, were withdrawn, or stand in wrong poses.
class RandomMerge : public testing::TestWithParam<int> {
 protected:
  bool Chance(double probability) { return Uniform() < probability; }
  double Uniform() { return std::uniform_real_distribution<double>(0, 1)(random_); }

  void GiveOwnCamera(ImageId id, Reconstruction* model) {
    Image& image = model->Image(id);
    Camera own = model->Camera(image.CameraId());
    own.SetCameraId(SceneMap::OwnCamera(id));
    own.SetFocalLength(own.MeanFocalLength() * (0.9 + 0.2 * Uniform()));
    model->AddCamera(own);
    image.SetCameraId(own.CameraId());
  }

  Reconstruction RandomSubmap(const SyntheticWorld& world, int first, int last,
                              const Similarity& gauge) {
    Reconstruction model = world.Submap(first, last, gauge, 0.98 + 0.04 * Uniform());
    const std::vector<ImageId> ids = model.RegImageIds();
    for (const ImageId id : ids) {
      if (Chance(0.2)) GiveOwnCamera(id, &model);
      if (Chance(0.1)) model.Image(id).SetTvec(model.Image(id).Tvec() + Eigen::Vector3d(2, 0, 0));
      if (Chance(0.1) && model.NumRegImages() > 4) model.DeRegisterImage(id);
    }
    return model;
  }

  std::mt19937 random_{static_cast<unsigned>(GetParam())};
};

TEST_P(RandomMerge, GivesAWholeModelOrAReason) {
  SyntheticOptions options = WallOptions();
  options.num_points = 800;
  options.second_camera_from = Chance(0.5) ? 15 : 0;
  const SyntheticWorld world(options, static_cast<unsigned>(GetParam()));
  const Similarity gauge{3.0, Eigen::Quaterniond(1, 0.3, -0.5, 0.2).normalized(), {5, -2, 8}};
  const Reconstruction target = RandomSubmap(world, 1, 14, Similarity());
  const Reconstruction source = RandomSubmap(world, 9, 24, gauge);
  AbsorbOptions absorb;
  absorb.verify = Chance(0.5);
  const AbsorbResult result = Absorb(target, source, gauge.Inverse(), absorb);
  if (!result.status.ok()) {
    EXPECT_NE(result.status.error(), "");
    return;
  }
  const std::set<ImageId> merged = RegisteredIn(result.merged);
  for (const Reconstruction* model : {&target, &source}) {
    for (const ImageId id : RegisteredIn(*model)) {
      EXPECT_EQ(merged.count(id) + result.left_out.count(id), 1u) << "photo " << id;
    }
  }
  for (const ImageId id : merged) {
    ASSERT_TRUE(result.merged.ExistsCamera(result.merged.Image(id).CameraId())) << "photo " << id;
  }
  for (const auto& [id, point] : result.merged.Points3D()) {
    for (const auto& element : point.Track().Elements()) {
      ASSERT_EQ(merged.count(element.image_id), 1u);
      ASSERT_EQ(result.merged.Image(element.image_id).Point2D(element.point2D_idx).Point3DId(), id);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Absorb, RandomMerge, testing::Range(1, 41));

// Photo 12 has a camera of its own in the source alone, and the target keeps its pose.
TEST(Absorb, AnOwnCameraOfAPhotoWhosePoseTheTargetKeeps) {
  Merge m{Case()};
  Camera own = m.source.Camera(1);
  own.SetCameraId(SceneMap::OwnCamera(12));
  m.source.AddCamera(own);
  m.source.Image(12).SetCameraId(own.CameraId());
  const AbsorbResult result = Absorb(m.target, m.source, AlignSubmaps(m.source, m.target), {});
  ASSERT_TRUE(result.status.ok()) << result.status.error();
  EXPECT_EQ(result.merged.Image(12).CameraId(), 1u);
}

}  // namespace skein::absorb_test
