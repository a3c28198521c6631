#include "map/filters.h"

#include <gtest/gtest.h>

#include "map/map_access.h"
#include "testing/synthetic_scene.h"

namespace skein {
namespace {

class FiltersTest : public testing::Test {
 protected:
  FiltersTest() {
    AddToMap(scene_, scene_.pairs, &map_);
    RegisterAtTruth(scene_, map_.photos(), Eigen::Vector3d::Zero(), &map_);
  }

  const colmap::Point3D& Point(Point3DId id) const { return map_.reconstruction().Point3D(id); }
  // The first point with a track of at least that length.
  Point3DId FindPoint(size_t min_length) {
    for (const Point3DId id : AllPoints(map_)) {
      if (Point(id).Track().Length() >= min_length) return id;
    }
    throw std::logic_error("no point with such a track");
  }

  const SyntheticScene scene_ = MakeScene({});
  SceneMap map_;
};

TEST_F(FiltersTest, APointThatFitsKeepsAllAndGetsItsMeanError) {
  const size_t num_points = map_.reconstruction().NumPoints3D();
  EXPECT_EQ(FilterPoints({}, AllPoints(map_), &map_), 0);
  EXPECT_EQ(map_.reconstruction().NumPoints3D(), num_points);
  EXPECT_GT(Point(FindPoint(2)).Error(), 0);
  EXPECT_LT(Point(FindPoint(2)).Error(), 2);
}

TEST_F(FiltersTest, AnObservationWithALargeErrorGoesAlone) {
  const Point3DId id = FindPoint(4);
  const size_t length = Point(id).Track().Length();
  const colmap::TrackElement wrong = Point(id).Track().Element(1);
  colmap::Image& image = MapAccess::Model(&map_).Image(wrong.image_id);
  image.Point2D(wrong.point2D_idx).SetXY(image.Point2D(wrong.point2D_idx).XY().array() + 10);
  EXPECT_EQ(FilterPoints({}, {id}, &map_), 1);
  EXPECT_EQ(Point(id).Track().Length(), length - 1);
  EXPECT_FALSE(image.Point2D(wrong.point2D_idx).HasPoint3D());
}

TEST_F(FiltersTest, APointWithoutTwoGoodObservationsGoes) {
  const Point3DId id = FindPoint(3);
  const int length = static_cast<int>(Point(id).Track().Length());
  map_.SetPoint(id, Point(id).XYZ() + Eigen::Vector3d(1, 1, 0));
  EXPECT_EQ(FilterPoints({}, {id}, &map_), length);
  EXPECT_FALSE(map_.reconstruction().ExistsPoint3D(id));
}

TEST_F(FiltersTest, APointUnderTooSmallAnAngleGoes) {
  const Point3DId id = FindPoint(2);
  FilterOptions options;
  options.min_triangulation_angle_deg = 170;
  EXPECT_GT(FilterPoints(options, {id}, &map_), 1);
  EXPECT_FALSE(map_.reconstruction().ExistsPoint3D(id));
}

TEST_F(FiltersTest, APointThatIsGoneIsPassedOver) {
  const Point3DId id = FindPoint(2);
  map_.DeletePoint(id);
  EXPECT_EQ(FilterPoints({}, {id}, &map_), 0);
}

}  // namespace
}  // namespace skein
