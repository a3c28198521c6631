#include "map/filters.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "map/map_access.h"
#include "testing/synthetic_scene.h"

namespace skein::filters_test {

class FiltersTest : public testing::Test {
 protected:
  FiltersTest() {
    AddToMap(scene_, scene_.pairs, &map_);
    RegisterAtTruth(scene_, map_.photos(), Eigen::Vector3d::Zero(), &map_);
  }

  const Point3D& Point(Point3DId id) const { return map_.reconstruction().Point3D(id); }
  // The first point with a track of at least that length.
  Point3DId FindPoint(size_t min_length) {
    for (const Point3DId id : AllPoints(map_)) {
      if (Point(id).Track().Length() >= min_length) return id;
    }
    throw std::logic_error("no point with such a track");
  }

  void KeepTwoObservations(Point3DId id) {
    while (Point(id).Track().Length() > 2) {
      const TrackElement last = Point(id).Track().Elements().back();
      MapAccess::Model(&map_).DeleteObservation(last.image_id, last.point2D_idx);
    }
  }

  const SyntheticScene scene_ = MakeScene({});
  SceneMap map_;
};

TEST_F(FiltersTest, APointThatFitsKeepsAllAndGetsItsMeanError) {
  const size_t num_points = map_.reconstruction().NumPoints3D();
  EXPECT_EQ(FilterPoints(AllPoints(map_), &map_), 0);
  EXPECT_EQ(map_.reconstruction().NumPoints3D(), num_points);
  EXPECT_GT(Point(FindPoint(2)).Error(), 0);
  EXPECT_LT(Point(FindPoint(2)).Error(), 2);
}

TEST_F(FiltersTest, AnObservationWithALargeErrorGoesAlone) {
  const Point3DId id = FindPoint(4);
  const size_t length = Point(id).Track().Length();
  const TrackElement wrong = Point(id).Track().Element(1);
  Image& image = MapAccess::Model(&map_).Image(wrong.image_id);
  image.Point2D(wrong.point2D_idx).SetXY(image.Point2D(wrong.point2D_idx).XY().array() + 10);
  EXPECT_EQ(FilterPoints({id}, &map_), 1);
  EXPECT_EQ(Point(id).Track().Length(), length - 1);
  EXPECT_FALSE(image.Point2D(wrong.point2D_idx).HasPoint3D());
}

TEST_F(FiltersTest, APointWithoutTwoGoodObservationsGoes) {
  const Point3DId id = FindPoint(3);
  const int length = static_cast<int>(Point(id).Track().Length());
  map_.SetPoint(id, Point(id).XYZ() + Eigen::Vector3d(1, 1, 0));
  EXPECT_EQ(FilterPoints({id}, &map_), length);
  EXPECT_FALSE(map_.reconstruction().ExistsPoint3D(id));
}

// While a map is adjusted they stay: rgbd-scene's focal length gets a third shorter, and its angles
// with it.
TEST_F(FiltersTest, APointUnderTooSmallAnAngleGoesWhenTheMapIsAdjusted) {
  const Point3DId id = FindPoint(2);
  Reconstruction& model = MapAccess::Model(&map_);
  KeepTwoObservations(id);
  ASSERT_EQ(FilterPoints({id}, &map_), 0);
  const TrackElement first = Point(id).Track().Element(0), second = Point(id).Track().Element(1);
  const Image& image = model.Image(first.image_id);
  Image& same_place = model.Image(second.image_id);
  same_place.SetQvec(image.Qvec());
  same_place.SetTvec(image.Tvec());
  same_place.Point2D(second.point2D_idx).SetXY(image.Point2D(first.point2D_idx).XY());
  EXPECT_EQ(FilterObservations({id}, &map_), 0);
  EXPECT_TRUE(map_.reconstruction().ExistsPoint3D(id));
  EXPECT_EQ(FilterPoints({id}, &map_), 2);
  EXPECT_FALSE(map_.reconstruction().ExistsPoint3D(id));
}

// Two photos of mamechun-room and their ten false points had shrunk to 1e-8 of its size.
TEST_F(FiltersTest, APointAtTheCentreOfAPhotoGoes) {
  const Point3DId id = FindPoint(2);
  KeepTwoObservations(id);
  const ImageId photo = Point(id).Track().Element(1).image_id;
  const Image& image = map_.reconstruction().Image(photo);
  const auto move_to = [&](double depth) {
    map_.SetPoint(id, image.ProjectionCenter() + depth * image.RotationMatrix().row(2).transpose());
  };
  move_to(0.5);
  EXPECT_EQ(FilterNearPoints({photo}, &map_), 0);
  move_to(1e-3);
  EXPECT_EQ(FilterNearPoints({photo}, &map_), 1);
  EXPECT_FALSE(map_.reconstruction().ExistsPoint3D(id));
}

// A false match lies up to the limit beside the epipolar line; without a third photo nothing else
// would tell.
TEST_F(FiltersTest, APointOfTwoPhotosHasToFitAsWellAsThoseOfMore) {
  FilterPoints(AllPoints(map_), &map_);  // sets the errors
  Reconstruction& model = MapAccess::Model(&map_);
  const std::vector<Point3DId> ids = AllPoints(map_);
  const Point3DId good = *std::find_if(ids.begin(), ids.end(), [this](Point3DId id) {
    return Point(id).Track().Length() >= 4 && Point(id).Error() < 0.25;
  });
  KeepTwoObservations(good);
  FilterPointsOfTwoPhotos(&map_);
  ASSERT_TRUE(map_.reconstruction().ExistsPoint3D(good));
  const auto move = [&](Point3DId id) {
    const TrackElement element = Point(id).Track().Element(0);
    Point2D& point = model.Image(element.image_id).Point2D(element.point2D_idx);
    point.SetXY(point.XY() + Eigen::Vector2d(2.5, 0));
  };
  const Point3DId of_three = FindPoint(3);
  move(of_three);
  move(good);
  EXPECT_EQ(FilterPoints(AllPoints(map_), &map_), 0) << "within the limit";
  EXPECT_EQ(FilterPointsOfTwoPhotos(&map_), 1);
  EXPECT_FALSE(map_.reconstruction().ExistsPoint3D(good));
  EXPECT_TRUE(map_.reconstruction().ExistsPoint3D(of_three));
}

TEST_F(FiltersTest, AMapOfTwoPhotosKeepsItsPoints) {
  SceneMap two;
  AddToMap(scene_, scene_.pairs, &two);
  const std::vector<ImageId> photos = two.photos();
  RegisterAtTruth(scene_, {photos[0], photos[1]}, Eigen::Vector3d::Zero(), &two);
  ASSERT_GT(two.reconstruction().NumPoints3D(), 0u);
  EXPECT_EQ(FilterPointsOfTwoPhotos(&two), 0);
}

TEST_F(FiltersTest, APointThatIsGoneIsPassedOver) {
  const Point3DId id = FindPoint(2);
  map_.DeletePoint(id);
  EXPECT_EQ(FilterPoints({id}, &map_), 0);
}

}  // namespace skein::filters_test
