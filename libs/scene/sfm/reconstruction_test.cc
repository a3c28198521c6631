#include "sfm/reconstruction.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace skein::reconstruction_test {

Image MakeImage(ImageId id) {
  Image image;
  image.SetImageId(id);
  image.SetCameraId(1);
  image.SetTvec({0.5 * id, 0, 1});
  image.SetPoints2D({{10, 20}, {30, 40}, {50, 60}});
  return image;
}

// Three registered images of one camera; one point that all observe.
class ReconstructionTest : public testing::Test {
 protected:
  ReconstructionTest() {
    Camera camera;
    camera.SetCameraId(1);
    camera.InitializeWithName("PINHOLE", 500, 640, 480);
    model_.AddCamera(camera);
    for (const ImageId id : {1, 2, 3}) {
      model_.AddImage(MakeImage(id));
      model_.RegisterImage(id);
    }
    point_ = model_.AddPoint3D({0, 0, 4}, TrackOf({{1, 0}, {2, 0}, {3, 0}}));
  }

  static Track TrackOf(const std::vector<TrackElement>& elements) {
    Track track;
    track.AddElements(elements);
    return track;
  }

  Reconstruction model_;
  Point3DId point_ = 0;
};

TEST_F(ReconstructionTest, KeypointsObserveThePointOfTheirTrack) {
  EXPECT_EQ(model_.Image(2).Point2D(0).Point3DId(), point_);
  EXPECT_EQ(model_.Image(2).NumPoints3D(), 1u);
  EXPECT_EQ(model_.ComputeNumObservations(), 3u);
  EXPECT_EQ(model_.ComputeMeanTrackLength(), 3);
  model_.DeletePoint3D(point_);
  EXPECT_FALSE(model_.Image(2).Point2D(0).HasPoint3D());
  EXPECT_EQ(model_.Image(2).NumPoints3D(), 0u);
  EXPECT_EQ(model_.ComputeMeanTrackLength(), 0);
}

TEST_F(ReconstructionTest, APointGoesWithTheLastButOneObservation) {
  model_.DeleteObservation(1, 0);
  EXPECT_EQ(model_.Point3D(point_).Track().Length(), 2u);
  model_.DeleteObservation(3, 0);
  EXPECT_FALSE(model_.ExistsPoint3D(point_));
  EXPECT_FALSE(model_.Image(2).Point2D(0).HasPoint3D());
}

TEST_F(ReconstructionTest, MergesToTheMeanByTrackLength) {
  const Point3DId other = model_.AddPoint3D({0, 0, 9}, TrackOf({{1, 1}, {2, 1}}), Rgb(100, 0, 0));
  const Point3DId merged = model_.MergePoints3D(point_, other);
  EXPECT_EQ(model_.NumPoints3D(), 1u);
  EXPECT_DOUBLE_EQ(model_.Point3D(merged).Z(), (3 * 4 + 2 * 9) / 5.0);
  EXPECT_EQ(model_.Point3D(merged).Color(0), 40);
  EXPECT_EQ(model_.Image(1).Point2D(1).Point3DId(), merged);
  EXPECT_EQ(model_.Image(3).Point2D(0).Point3DId(), merged);
}

TEST_F(ReconstructionTest, AnImageThatIsOutObservesNothing) {
  model_.DeRegisterImage(2);
  EXPECT_FALSE(model_.IsImageRegistered(2));
  EXPECT_EQ(model_.RegImageIds(), (std::vector<ImageId>{1, 3}));
  EXPECT_EQ(model_.Point3D(point_).Track().Length(), 2u);
}

TEST_F(ReconstructionTest, ATransformLeavesPixelsWhereTheyAre) {
  const auto pixel = [&] {
    const Eigen::Vector4d xyz = model_.Point3D(point_).XYZ().homogeneous();
    return Eigen::Vector2d((model_.Image(2).ProjectionMatrix() * xyz).hnormalized());
  };
  const Eigen::Vector2d before = pixel();
  const Eigen::Matrix3d R = Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()).matrix();
  model_.Transform(2.5, R, {1, -2, 3});
  EXPECT_LT((pixel() - before).norm(), 1e-12);
  EXPECT_LT((model_.Point3D(point_).XYZ() -
             (2.5 * R * Eigen::Vector3d(0, 0, 4) + Eigen::Vector3d(1, -2, 3)))
                .norm(),
            1e-12);
}

TEST_F(ReconstructionTest, RefusesBrokenContracts) {
  EXPECT_THROW(model_.AddImage(MakeImage(1)), std::logic_error);
  EXPECT_THROW(model_.AddPoint3D({0, 0, 1}, TrackOf({{1, 0}, {2, 1}})), std::logic_error);
  EXPECT_THROW(model_.AddObservation(point_, {4, 0}), std::out_of_range);
  EXPECT_THROW(model_.AddCamera(Camera()), std::logic_error);
  EXPECT_THROW(model_.Point3D(99), std::out_of_range);
}

}  // namespace skein::reconstruction_test
